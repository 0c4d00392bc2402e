#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/dataset/plan.hpp"
#include "apps/python/bindings/long_call.hpp"

// What the two functions that make datasets share.
namespace nbd::python {

/// Arguments of both, checked.
struct DatasetArguments {
    int trajectories, per_shard;
    std::optional<int> frames;  // none: those of the scene
    double held_out;
    std::string hold_out;
    bool contact_forces, stress, deformation_gradients;
};

/// The plan with what the arguments say. Throws std::invalid_argument, naming the argument.
DatasetPlan plan_of(const DatasetArguments& arguments);

/// Makes a dataset, with no Python in between. body_file: its name, for the card; that of a scene is known.
void produce(const Body& body, const DatasetPlan& plan, const std::filesystem::path& file,
             const std::string& body_file, const std::string& licence, Stoppable& stoppable,
             Progress& progress);

/// Runs work(stoppable, progress) of the function `name`, which Ctrl-C stops and the same call continues.
template <class Work>
void make_files(const char* name, const std::filesystem::path& file, const ProgressFunction& function,
                const Work& work) {
    Stoppable stoppable;
    Progress progress(function, stoppable);
    try {
        work(stoppable, progress);
    } catch (const StopAsked&) {
        progress.check();
        raise_stop(std::string(name) + ": was stopped; the same call continues from " + file.string());
    }
    progress.check();
}

}  // namespace nbd::python
