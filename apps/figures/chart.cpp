#include "apps/figures/chart.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nbd {
namespace {

constexpr double left = 62, top = 40, between = 26, panel_width = 300, panel_height = 230, panel_title = 24,
                 below = 44, legend_width = 150;
constexpr Colour ink{0.2, 0.2, 0.22}, faint{0.89, 0.9, 0.92}, frame{0.6, 0.6, 0.64};

/// A logarithmic axis with a line for 0 below it.
struct LogAxis {
    int low = -1, high = 0;  // decades
    bool has_zero = false;

    explicit LogAxis(const std::vector<Panel>& panels) {
        double least = INFINITY, most = 0;
        for (const Panel& panel : panels)
            for (const Series& series : panel.series)
                for (const PagePoint& p : series.points) {
                    has_zero |= p.y <= 0;
                    if (p.y > 0) least = std::min(least, p.y);
                    most = std::max(most, p.y);
                }
        if (most <= 0) return;
        low = static_cast<int>(std::floor(std::log10(least)));
        high = std::max(low + 1, static_cast<int>(std::ceil(std::log10(most))));
    }

    /// 0 at the bottom of a panel, 1 at its top.
    double place(double y) const {
        const double bottom = low - (has_zero ? zero_gap : 0);
        const double at = y > 0 ? std::log10(y) : bottom;
        return (at - bottom) / (high - bottom);
    }

    static constexpr double zero_gap = 0.7;  // decades between the lowest line and that of 0
};

/// "0.01", "10": a power of ten in full.
std::string decade(int power) {
    return power >= 0 ? fmt::format("{:.0f}", std::pow(10, power))
                      : fmt::format("{:.{}f}", std::pow(10, power), -power);
}

/// "16k", "1M": two digits of a large number.
std::string rounded(double value) {
    if (value >= 1e6) return fmt::format("{:.2g}M", value / 1e6);
    if (value >= 1e5) return fmt::format("{:.0f}k", value / 1e3);
    return value >= 1e3 ? fmt::format("{:.2g}k", value / 1e3) : fmt::format("{:g}", value);
}

struct Painter {
    const Chart& chart;
    LogAxis axis;
    Canvas& canvas;

    double x_place(double x) const {
        const auto scale = [&](double value) { return chart.log_x ? std::log(value) : value; };
        const double low = scale(chart.x_ticks.front()), high = scale(chart.x_ticks.back());
        return high > low ? (scale(x) - low) / (high - low) : 0.5;
    }

    void panel(const Panel& panel, PagePoint corner, bool leftmost, bool lowest) const {
        const double bottom = corner.y + panel_height, right = corner.x + panel_width;
        const auto at = [&](PagePoint p) {
            return PagePoint{corner.x + x_place(p.x) * panel_width, bottom - axis.place(p.y) * panel_height};
        };
        const auto line = [&](PagePoint a, PagePoint b, double width, Colour colour) {
            canvas.polyline(std::array{a, b}, width, colour);
        };
        canvas.text({corner.x + panel_width / 2, corner.y - 8}, panel.title,
                    {.align = Align::centre, .colour = ink, .bold = true});
        for (int power = axis.low; power <= axis.high; ++power) {
            const double y = bottom - axis.place(std::pow(10, power)) * panel_height;
            line({corner.x, y}, {right, y}, 0.8, faint);
            if (leftmost)
                canvas.text({corner.x - 6, y + 4}, decade(power), {.size = 10, .align = Align::right});
        }
        if (axis.has_zero && leftmost)
            canvas.text({corner.x - 6, bottom + 4}, "0", {.size = 10, .align = Align::right});
        for (const double tick : chart.x_ticks) {
            const double x = corner.x + x_place(tick) * panel_width;
            line({x, corner.y}, {x, bottom}, 0.8, faint);
            if (lowest)
                canvas.text({x, bottom + 15}, chart.log_x ? rounded(tick) : fmt::format("{:g}", tick),
                            {.size = 10, .align = Align::centre});
        }
        line({corner.x, corner.y}, {corner.x, bottom}, 1, frame);
        line({corner.x, bottom}, {right, bottom}, 1, frame);
        for (const Series& series : panel.series) {
            std::vector<PagePoint> points;
            for (const PagePoint& p : series.points) points.push_back(at(p));
            canvas.polyline(points, 1.8, series.colour, series.dash);
            for (const PagePoint& p : points) canvas.dot(p, 2.4, series.colour);
        }
        if (lowest)
            canvas.text({corner.x + panel_width / 2, bottom + 34}, chart.x_label, {.align = Align::centre});
    }

    void legend(PagePoint corner) const {
        std::vector<std::string> seen;
        for (const Panel& panel : chart.panels)
            for (const Series& series : panel.series) {
                if (std::ranges::find(seen, series.label) != seen.end()) continue;
                const double y = corner.y + 17 * static_cast<double>(seen.size());
                seen.push_back(series.label);
                canvas.polyline(std::array{PagePoint{corner.x, y}, PagePoint{corner.x + 26, y}}, 1.8,
                                series.colour, series.dash);
                canvas.dot({corner.x + 13, y}, 2.4, series.colour);
                canvas.text({corner.x + 33, y + 4}, series.label, {.size = 10.5});
            }
    }
};

}  // namespace

Page to_page(const Chart& chart) {
    const int columns = std::min(chart.columns, static_cast<int>(chart.panels.size()));
    const int rows = (static_cast<int>(chart.panels.size()) + columns - 1) / columns;
    const double width = left + columns * (panel_width + between) + legend_width;
    const double height = top + rows * (panel_title + panel_height) + below;
    return {width, height, [chart, columns, rows, height](Canvas& canvas) {
                const Painter painter{chart, LogAxis(chart.panels), canvas};
                canvas.text({left, 22}, chart.title, {.size = 13, .colour = ink, .bold = true});
                canvas.text({16, (top + panel_title + height - below) / 2}, chart.y_label,
                            {.align = Align::centre, .upwards = true});
                for (int i = 0; i < static_cast<int>(chart.panels.size()); ++i) {
                    const int column = i % columns, row = i / columns;
                    painter.panel(chart.panels[static_cast<std::size_t>(i)],
                                  {left + column * (panel_width + between),
                                   top + row * (panel_title + panel_height) + panel_title},
                                  column == 0, row == rows - 1);
                }
                painter.legend({left + columns * (panel_width + between), top + panel_title + 8});
            }};
}

Colour category_colour(int i) {
    // After Okabe and Ito.
    constexpr std::array<Colour, 7> colours{{{0.00, 0.45, 0.70},
                                             {0.84, 0.37, 0.00},
                                             {0.00, 0.62, 0.45},
                                             {0.80, 0.47, 0.65},
                                             {0.90, 0.62, 0.00},
                                             {0.34, 0.71, 0.91},
                                             {0.35, 0.35, 0.38}}};
    return colours[static_cast<std::size_t>(i) % colours.size()];
}

Colour ramp_colour(double share) {
    // Stops of a ramp of even lightness steps, dark blue to yellow-green.
    constexpr std::array<Colour, 5> stops{
        {{0.27, 0.00, 0.33}, {0.23, 0.32, 0.55}, {0.13, 0.57, 0.55}, {0.37, 0.79, 0.38}, {0.85, 0.80, 0.10}}};
    const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const double t = at - static_cast<double>(i);
    const auto mix = [&](double a, double b) { return a + t * (b - a); };
    return {mix(stops[i].r, stops[i + 1].r), mix(stops[i].g, stops[i + 1].g),
            mix(stops[i].b, stops[i + 1].b)};
}

}  // namespace nbd
