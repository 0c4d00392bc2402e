#include "apps/cli/output.hpp"

#include <cstdio>

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
    erase_progress();
    fmt::print(stderr, "{}: warning: {}\n", program, line);
}

void Output::announcement(std::string_view line) const {
    end_progress();
    fmt::print(stderr, "{}: {}\n", program, line);
}

void Output::result(const nlohmann::ordered_json& value) const {
    if (json) fmt::print("{}\n", value.dump(2));
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
