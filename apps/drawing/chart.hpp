#pragma once

#include <string>
#include <vector>

#include "apps/drawing/canvas.hpp"

namespace nbd {

/// One line of a panel. Lines with the same label look alike in all panels and stand in the legend once.
struct Series {
    std::string label;
    Colour colour;
    Dash dash = Dash::solid;
    std::vector<PagePoint> points;  // in the units of the axes, ascending x
};

struct Panel {
    std::string title;
    std::vector<Series> series;
};

/// Panels of lines over one pair of axes: x linear or logarithmic, y logarithmic. What is 0 stands on a line
/// of its own below the lowest decade.
struct Chart {
    std::string title, x_label, y_label;
    std::vector<double> x_ticks;  // first and last bound the axis; at least two
    std::vector<Panel> panels;
    int columns = 2;     // panels in a row
    bool log_x = false;  // ticks then are above 0, and told as 16k or 1M
};

Page to_page(const Chart& chart);

/// The colour of the i-th of a few unordered things; told apart by colour-blind people too.
Colour category_colour(int i);

/// Its dash: another one each time that the colours begin anew.
Dash category_dash(int i);

/// The colour of a share in [0, 1] of an ordered range, dark to light.
Colour ramp_colour(double share);

}  // namespace nbd
