#pragma once

#include <string>
#include <vector>

#include "apps/drawing/canvas.hpp"

namespace nbd {

/// One line of a panel. Lines with the same label should look alike; they share one legend entry.
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

/// Panels of lines over one pair of axes: x linear or logarithmic, y logarithmic. Zeros are drawn on a
/// separate line below the lowest decade.
struct Chart {
    std::string title, x_label, y_label;
    std::vector<double> x_ticks;  // the first and the last are the axis limits; at least two
    std::vector<Panel> panels;
    int columns = 2;     // panels per row
    bool log_x = false;  // ticks must then be > 0 and are written as 16k or 1M
};

Page to_page(const Chart& chart);

/// Colour of the i-th category; distinguishable for colour-blind people.
Colour category_colour(int i);

/// Dash of the i-th category; changes each time the colours repeat.
Dash category_dash(int i);

/// Colour for a position in [0, 1] of an ordered range, dark to light.
Colour ramp_colour(double share);

}  // namespace nbd
