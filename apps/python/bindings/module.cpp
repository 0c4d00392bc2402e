// The compiled part of the Python package nbdtree.
#include <pybind11/pybind11.h>
#include <tbb/global_control.h>

#include <exception>
#include <memory>
#include <stdexcept>
#include <utility>

#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "collision/base/notice.hpp"
#include "collision/base/stop.hpp"
#include "meshing/h5/version.hpp"

namespace nbd::python {
namespace {

std::unique_ptr<tbb::global_control> thread_limit;

int thread_count() { return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism); }

void set_thread_count(int count) {
    if (count < 1) throw std::invalid_argument("threads: must be at least 1");
    thread_limit.reset();  // first, since the smallest of several limits holds
    thread_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, count);
}

}  // namespace

PYBIND11_MODULE(_nbdtree, module) {
    module.attr("__version__") = std::string(version());
    set_notice_handler(warn);
    py::register_exception<Stopped>(module, "Stopped", PyExc_KeyboardInterrupt).attr("__doc__") =
        "A long call was stopped although no signal handler raised an exception.";
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            std::rethrow_exception(std::move(thrown));
        } catch (const StopAsked&) {
            raise_stop("the call was stopped, nothing of it is kept");
        }
    });
    // Python copies the module into further interpreters without calling it.
    module.def("_check_interpreter", [] {
        if (PyInterpreterState_Get() != PyInterpreterState_Main())
            throw py::import_error("nbdtree: works in the main interpreter only");
    });
    module.def("thread_count", thread_count, "Threads that one call may use.");
    module.def("set_thread_count", set_thread_count, py::arg("count"),
               "Limits the threads that one call may use, from now on. Results do not depend on it.");
    bind_surfaces(module);
    bind_bodies(module);
    bind_trees(module);
    bind_queries(module);
    bind_features(module);
    bind_worlds(module);
    bind_recordings(module);
    bind_datasets(module);
    bind_templates(module);
    bind_training(module);
    guard(module);
    py::module_::import("atexit").attr("register")(py::cpp_function([] {
        end_calls();
        thread_limit.reset();  // while TBB is still there
    }));
}

}  // namespace nbd::python
