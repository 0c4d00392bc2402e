#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "apps/drawing/image.hpp"

namespace nbd {

struct Colour {
    double r = 0, g = 0, b = 0;  // 0 to 1
};

/// Position on a page: units right and down from the upper left corner.
struct PagePoint {
    double x = 0, y = 0;
};

enum class Dash { solid, dashed, dotted, mixed };
enum class Align { left, centre, right };

struct TextStyle {
    double size = 11;
    Align align = Align::left;
    Colour colour{0.2, 0.2, 0.22};
    bool bold = false, upwards = false;
};

/// Paints on a page.
class Canvas {
 public:
    virtual ~Canvas() = default;
    virtual void rectangle(PagePoint corner, double width, double height, Colour fill) = 0;
    virtual void polyline(std::span<const PagePoint> points, double width, Colour colour,
                          Dash dash = Dash::solid) = 0;
    virtual void dot(PagePoint centre, double radius, Colour fill) = 0;
    /// at: left end, centre or right end of the baseline, as style.align says.
    virtual void text(PagePoint at, std::string_view text, const TextStyle& style) = 0;
    /// Scales the image to `width`, keeping its proportions.
    virtual void image(PagePoint corner, double width, const Image& image) = 0;
};

/// Width of a line of text, in page units. Throws std::runtime_error if the drawing library fails.
double text_width(std::string_view text, const TextStyle& style);

/// A page and the function that paints it, in any output format.
struct Page {
    double width = 0, height = 0;
    std::function<void(Canvas&)> paint;
};

/// The page on white, as the bytes of an SVG file. Throws std::runtime_error if the drawing library fails.
std::string to_svg(const Page& page);

/// The page on white, as the bytes of a PNG file with `scale` pixels per unit. Throws as to_svg().
std::string to_png(const Page& page, double scale = 2);

/// Writes STEM.svg and STEM.png, each atomically. Throws std::runtime_error with path and reason.
void write_page(const std::filesystem::path& stem, const Page& page);

}  // namespace nbd
