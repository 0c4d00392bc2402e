#include "apps/cli/output.hpp"

#include <cstdio>
#include <stdexcept>

#include "apps/cli/progress_bar.hpp"
#include "apps/cli/test_points.hpp"

namespace nbd {
namespace {

void erase_progress() {
    if (ProgressBar* const bar = progress_bar()) bar->erase();
}

}  // namespace

ProgressBar* Output::bar() const { return quiet || json ? nullptr : progress_bar(); }

void Output::text(std::string_view line) const {
    if (quiet || json) return;
    erase_progress();
    fmt::print("{}\n", line);
}

void Output::warning(std::string_view line) const {
    if (strict) throw std::runtime_error(std::string(line));
    late_warning(line);
}

void Output::late_warning(std::string_view line) const {
    const std::scoped_lock lock(warnings_->mutex);
    erase_progress();
    fmt::print(stderr, "{}: warning: {}\n", program, line);
    warnings_->lines.emplace_back(line);
    if (warnings_->late.empty()) warnings_->late = line;
}

void Output::end_if_strict() const {
    const std::scoped_lock lock(warnings_->mutex);
    if (strict && !warnings_->late.empty()) throw std::runtime_error(warnings_->late);
}

void Output::announcement(std::string_view line) const {
    end_progress();
    fmt::print(stderr, "{}: {}\n", program, line);
}

void Output::result(nlohmann::ordered_json value) const {
    if (!json) return;
    const std::scoped_lock lock(warnings_->mutex);
    if (value.is_object()) value["warnings"] = warnings_->lines;
    fmt::print("{}\n", value.dump(2));
}

void Output::work(std::string_view name) const {
    if (ProgressBar* const to = bar()) to->begin(name);
    pass_test_point(name, 0);
}

void Output::progress(std::string_view what, double done, double total, std::string_view note) const {
    if (ProgressBar* const to = bar()) to->count(what, done, total, note);
    pass_test_point(what, done);
}

void Output::progress_of_work(std::string_view what, double done, double total) const {
    if (ProgressBar* const to = bar()) to->count_part(what, done, total);
    pass_test_point(what, done);
}

void Output::end_progress() const {
    if (ProgressBar* const to = progress_bar()) to->end();
}

}  // namespace nbd
