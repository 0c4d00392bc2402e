#include "apps/drawing/chart.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace nbd {
namespace {

constexpr double least_left = 62, top = 40, between = 26, panel_width = 300, panel_height = 230,
                 panel_title = 24, below = 44, label_edge = 24, tick_gap = 6;
constexpr double legend_line = 17, legend_text = 33;  // line spacing, and indent of the text
constexpr TextStyle legend_style{.size = 10.5}, tick_style{.size = 10, .align = Align::right},
    title_style{.size = 13, .colour = {0.2, 0.2, 0.22}, .bold = true};
constexpr Colour ink{0.2, 0.2, 0.22}, faint{0.89, 0.9, 0.92}, frame{0.6, 0.6, 0.64};

/// Logarithmic axis with a separate line for 0 below it.
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

    /// Position of y in a panel: 0 at the bottom, 1 at the top.
    double place(double y) const {
        const double bottom = low - (has_zero ? zero_gap : 0);
        const double at = y > 0 ? std::log10(y) : bottom;
        return (at - bottom) / (high - bottom);
    }

    static constexpr double zero_gap = 0.7;  // decades between the lowest line and the line of 0
};

/// Writes a power of ten in full: "0.01", "10".
std::string decade(int power) {
    return power >= 0 ? fmt::format("{:.0f}", std::pow(10, power))
                      : fmt::format("{:.{}f}", std::pow(10, power), -power);
}

/// Writes a large number with two digits: "16k", "1M".
std::string rounded(double value) {
    if (value >= 1e6) return fmt::format("{:.2g}M", value / 1e6);
    if (value >= 1e5) return fmt::format("{:.0f}k", value / 1e3);
    return value >= 1e3 ? fmt::format("{:.2g}k", value / 1e3) : fmt::format("{:g}", value);
}

/// One series per label, in order of appearance.
std::vector<Series> legend_series(const Chart& chart) {
    std::vector<Series> seen;
    for (const Panel& panel : chart.panels)
        for (const Series& series : panel.series)
            if (std::ranges::find(seen, series.label, &Series::label) == seen.end()) seen.push_back(series);
    return seen;
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
            if (leftmost) canvas.text({corner.x - tick_gap, y + 4}, decade(power), tick_style);
        }
        if (axis.has_zero && leftmost) canvas.text({corner.x - tick_gap, bottom + 4}, "0", tick_style);
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
        for (const Series& series : legend_series(chart)) {
            canvas.polyline(std::array{corner, PagePoint{corner.x + 26, corner.y}}, 1.8, series.colour,
                            series.dash);
            canvas.dot({corner.x + 13, corner.y}, 2.4, series.colour);
            canvas.text({corner.x + legend_text, corner.y + 4}, series.label, legend_style);
            corner.y += legend_line;
        }
    }
};

/// Palette of Okabe and Ito.
constexpr std::array<Colour, 7> category_colours{{{0.00, 0.45, 0.70},
                                                  {0.84, 0.37, 0.00},
                                                  {0.00, 0.62, 0.45},
                                                  {0.80, 0.47, 0.65},
                                                  {0.90, 0.62, 0.00},
                                                  {0.34, 0.71, 0.91},
                                                  {0.35, 0.35, 0.38}}};

}  // namespace

Page to_page(const Chart& chart) {
    const int columns = std::min(chart.columns, static_cast<int>(chart.panels.size()));
    const int rows = (static_cast<int>(chart.panels.size()) + columns - 1) / columns;
    const LogAxis axis(chart.panels);
    double ticks_width = 0;
    for (int power = axis.low; power <= axis.high; ++power)
        ticks_width = std::max(ticks_width, text_width(decade(power), tick_style));
    const double left = std::max(least_left, label_edge + ticks_width + tick_gap);
    const std::vector<Series> legend = legend_series(chart);
    double legend_width = 0;
    for (const Series& series : legend)
        legend_width = std::max(legend_width, legend_text + text_width(series.label, legend_style));
    const double title_width = text_width(chart.title, title_style);
    const double right_edge = std::max(columns * (panel_width + between) + legend_width, title_width) + 12;
    const double legend_height = panel_title + legend_line * static_cast<double>(legend.size());
    const double width = left + right_edge;
    const double panels_height = rows * (panel_title + panel_height);
    const double height = top + std::max(panels_height + below, legend_height);
    return {width, height, [chart, axis, columns, rows, left, panels_height](Canvas& canvas) {
                const Painter painter{chart, axis, canvas};
                canvas.text({left, 22}, chart.title, title_style);
                canvas.text({16, top + (panel_title + panels_height) / 2}, chart.y_label,
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
    return category_colours[static_cast<std::size_t>(i) % category_colours.size()];
}

Dash category_dash(int i) {
    constexpr std::array dashes{Dash::solid, Dash::dashed, Dash::dotted, Dash::mixed};
    return dashes[static_cast<std::size_t>(i) / category_colours.size() % dashes.size()];
}

Colour ramp_colour(double share) {
    // Ramp with even lightness steps, dark blue to yellow-green.
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
