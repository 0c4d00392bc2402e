#include "apps/bench/physics/physics_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace nbd {
namespace {

constexpr double cell = 13, label_width = 150, head = 62, foot = 76, between_sizes = 4, between_modes = 18;

// Upper limits of the columns, metres and seconds.
constexpr std::array sizes{0.03, 0.3, 3.0, std::numeric_limits<double>::infinity()};
constexpr std::array steps{3e-4, 2e-3, 7e-3, std::numeric_limits<double>::infinity()};
constexpr std::array<const char*, 4> size_names{"1 cm", "10 cm", "1 m", "10 m"};
constexpr std::array<const char*, 4> step_names{"0.1", "1", "5", "20"};

/// Colours of a largest error over what is allowed, up to `most`.
struct Shade {
    double most;
    Colour colour;
    const char* name;
};
constexpr std::array shades{
    Shade{0.1, {0.16, 0.44, 0.66}, "a tenth of the allowed error at most"},
    Shade{1, {0.62, 0.80, 0.90}, "holds"}, Shade{10, {0.99, 0.75, 0.44}, "up to ten times the allowed error"},
    Shade{1e3, {0.90, 0.38, 0.13}, "up to a thousand times"},
    Shade{std::numeric_limits<double>::infinity(), {0.45, 0.02, 0.10}, "more, or a step failed"}};
constexpr Colour empty{0.94, 0.94, 0.94};

template <std::size_t N>
std::size_t column(const std::array<double, N>& limits, double value) {
    return static_cast<std::size_t>(std::ranges::find_if(limits, [&](double most) { return value <= most; }) -
                                    limits.begin());
}

double ratio(const PhysicsCheck& check, const PhysicsRow& row) {
    if (check.allowed > 0) return row.found.error / check.allowed;
    return row.found.error > 0 ? std::numeric_limits<double>::infinity() : 0;
}

Colour colour_of(double ratio) {
    return std::ranges::find_if(shades, [&](const Shade& shade) { return ratio <= shade.most; })->colour;
}

double left_of(std::size_t mode, std::size_t size, std::size_t step) {
    constexpr double of_size = 4 * cell + between_sizes;
    return label_width + static_cast<double>(mode) * (4 * of_size + between_modes) +
           static_cast<double>(size) * of_size + static_cast<double>(step) * cell;
}

}  // namespace

Page physics_page(std::vector<PhysicsResult> results) {
    const double width = left_of(2, 0, 0), bottom = head + cell * static_cast<double>(results.size());
    const auto paint = [results = std::move(results), bottom](Canvas& canvas) {
        for (const std::size_t mode : {0U, 1U}) {
            canvas.text({left_of(mode, 0, 0), 16}, mode == 0 ? "default" : "intersection_free",
                        {.size = 12, .bold = true});
            for (std::size_t size = 0; size < 4; ++size) {
                canvas.text({left_of(mode, size, 2), 34}, size_names[size], {.align = Align::centre});
                for (std::size_t step = 0; step < 4; ++step)
                    canvas.text({left_of(mode, size, step) + cell / 2, 52}, step_names[step],
                                {.size = 7, .align = Align::centre});
            }
        }
        canvas.text({label_width - 8, 52}, "step, ms", {.size = 8, .align = Align::right});
        double y = head;
        for (const PhysicsResult& result : results) {
            canvas.text({label_width - 8, y + 0.75 * cell}, result.check.name,
                        {.size = 10, .align = Align::right, .bold = !result.held()});
            std::array<double, 32> worst{};
            worst.fill(-1);
            for (const PhysicsRow& row : result.rows) {
                double& at = worst[(row.at.intersection_free ? 16 : 0) + 4 * column(sizes, row.at.size) +
                                   column(steps, row.at.dt)];
                at = std::max(at, ratio(result.check, row));
            }
            for (std::size_t k = 0; k < worst.size(); ++k)
                canvas.rectangle({left_of(k / 16, k / 4 % 4, k % 4) + 0.5, y + 0.5}, cell - 1, cell - 1,
                                 worst[k] < 0 ? empty : colour_of(worst[k]));
            y += cell;
        }
        PagePoint at{label_width, bottom + 14};
        for (const Shade& shade : shades) {
            canvas.rectangle(at, cell - 1, cell - 1, shade.colour);
            canvas.text({at.x + cell + 4, at.y + 0.75 * cell}, shade.name, {.size = 10});
            at.x += 250;
            if (at.x > label_width + 250) at = {label_width, at.y + 18};
        }
    };
    return {.width = width, .height = bottom + foot, .paint = paint};
}

}  // namespace nbd
