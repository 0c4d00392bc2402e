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

/// A place on a page: units to the right and down of its upper left corner.
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

/// What a page is painted with.
class Canvas {
 public:
    virtual ~Canvas() = default;
    virtual void rectangle(PagePoint corner, double width, double height, Colour fill) = 0;
    virtual void polyline(std::span<const PagePoint> points, double width, Colour colour,
                          Dash dash = Dash::solid) = 0;
    virtual void dot(PagePoint centre, double radius, Colour fill) = 0;
    /// at: left end, middle or right end of the line that the letters stand on.
    virtual void text(PagePoint at, std::string_view text, const TextStyle& style) = 0;
    /// The image fills the width; its height follows.
    virtual void image(PagePoint corner, double width, const Image& image) = 0;
};

/// How far a line of text reaches, in units of the page. Throws std::runtime_error where the drawing library
/// fails.
double text_width(std::string_view text, const TextStyle& style);

/// A page of text and lines: painted in the same way whatever it is written as.
struct Page {
    double width = 0, height = 0;
    std::function<void(Canvas&)> paint;
};

/// The page on white as an SVG file's bytes. Throws std::runtime_error where the drawing library fails.
std::string to_svg(const Page& page);

/// Likewise as a PNG file's, `scale` pixels a unit.
std::string to_png(const Page& page, double scale = 2);

/// Writes STEM.svg and STEM.png, each atomically. Throws std::runtime_error with path and reason.
void write_page(const std::filesystem::path& stem, const Page& page);

}  // namespace nbd
