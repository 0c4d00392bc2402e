#include "apps/drawing/canvas.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/core.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct Release {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, Release>;
using Context = std::unique_ptr<cairo_t, Release>;

void require(cairo_status_t status) {
    if (status != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error(fmt::format("cannot draw a page: {}", cairo_status_to_string(status)));
}

cairo_status_t append(void* bytes, const unsigned char* data, unsigned length) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
}

/// Selects the font of a style and returns the extents of the line.
cairo_text_extents_t set_font(cairo_t* context, const std::string& line, const TextStyle& style) {
    cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(context, style.size);
    cairo_text_extents_t size;
    cairo_text_extents(context, line.c_str(), &size);
    return size;
}

class CairoCanvas final : public Canvas {
 public:
    explicit CairoCanvas(cairo_t* context) : context_(context) {
        cairo_set_line_join(context_, CAIRO_LINE_JOIN_ROUND);
        cairo_set_line_cap(context_, CAIRO_LINE_CAP_BUTT);
    }

    void rectangle(PagePoint corner, double width, double height, Colour fill) override {
        use(fill);
        cairo_rectangle(context_, corner.x, corner.y, width, height);
        cairo_fill(context_);
    }

    void polyline(std::span<const PagePoint> points, double width, Colour colour, Dash dash) override {
        if (points.size() < 2) return;
        use(colour);
        cairo_set_line_width(context_, width);
        const std::vector<double> pattern = dash == Dash::dashed   ? std::vector<double>{5, 3}
                                            : dash == Dash::dotted ? std::vector<double>{1.5, 2.5}
                                            : dash == Dash::mixed  ? std::vector<double>{6, 2.5, 1.5, 2.5}
                                                                   : std::vector<double>{};
        cairo_set_dash(context_, pattern.data(), static_cast<int>(pattern.size()), 0);
        cairo_new_path(context_);
        for (const PagePoint& p : points) cairo_line_to(context_, p.x, p.y);
        cairo_stroke(context_);
    }

    void dot(PagePoint centre, double radius, Colour fill) override {
        use(fill);
        cairo_new_path(context_);
        cairo_arc(context_, centre.x, centre.y, radius, 0, 2 * std::numbers::pi);
        cairo_fill(context_);
    }

    void text(PagePoint at, std::string_view text, const TextStyle& style) override {
        const std::string line(text);
        use(style.colour);
        const cairo_text_extents_t size = set_font(context_, line, style);
        const double shift = style.align == Align::left    ? 0
                             : style.align == Align::right ? -size.x_advance
                                                           : -size.x_advance / 2;
        cairo_save(context_);
        cairo_translate(context_, at.x, at.y);
        if (style.upwards) cairo_rotate(context_, -std::numbers::pi / 2);
        cairo_move_to(context_, shift, 0);
        cairo_show_text(context_, line.c_str());
        cairo_restore(context_);
    }

    void image(PagePoint corner, double width, const Image& image) override {
        const Surface pixels(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
        require(cairo_surface_status(pixels.get()));
        unsigned char* rows = cairo_image_surface_get_data(pixels.get());
        const std::ptrdiff_t stride = cairo_image_surface_get_stride(pixels.get());
        for (int y = 0; y < image.height; ++y) {
            auto* row = reinterpret_cast<std::uint32_t*>(rows + y * stride);
            const std::uint8_t* rgb = image.rgb.data() + std::ptrdiff_t{3} * y * image.width;
            for (int x = 0; x < image.width; ++x, rgb += 3)
                row[x] = static_cast<std::uint32_t>(rgb[0] << 16 | rgb[1] << 8 | rgb[2]);
        }
        cairo_surface_mark_dirty(pixels.get());
        cairo_save(context_);
        cairo_translate(context_, corner.x, corner.y);
        cairo_scale(context_, width / image.width, width / image.width);
        cairo_set_source_surface(context_, pixels.get(), 0, 0);
        cairo_paint(context_);
        cairo_restore(context_);
    }

 private:
    void use(Colour c) { cairo_set_source_rgb(context_, c.r, c.g, c.b); }

    cairo_t* context_;
};

void paint(const Page& page, cairo_surface_t* surface, double scale) {
    const Context context(cairo_create(surface));
    cairo_scale(context.get(), scale, scale);
    CairoCanvas canvas(context.get());
    canvas.rectangle({0, 0}, page.width, page.height, {1, 1, 1});
    page.paint(canvas);
    require(cairo_status(context.get()));
}

void write(const std::filesystem::path& path, const std::string& bytes) {
    h5::AtomicFile file(path);
    file.out() << bytes;
    file.commit();
}

}  // namespace

double text_width(std::string_view text, const TextStyle& style) {
    const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1));
    const Context context(cairo_create(surface.get()));
    const double width = set_font(context.get(), std::string(text), style).x_advance;
    require(cairo_status(context.get()));
    return width;
}

std::string to_svg(const Page& page) {
    std::string bytes;
    const Surface surface(cairo_svg_surface_create_for_stream(append, &bytes, page.width, page.height));
    paint(page, surface.get(), 1);
    cairo_surface_finish(surface.get());
    require(cairo_surface_status(surface.get()));
    return bytes;
}

std::string to_png(const Page& page, double scale) {
    const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                                     static_cast<int>(std::ceil(scale * page.width)),
                                                     static_cast<int>(std::ceil(scale * page.height))));
    paint(page, surface.get(), scale);
    std::string bytes;
    require(cairo_surface_write_to_png_stream(surface.get(), append, &bytes));
    return bytes;
}

void write_page(const std::filesystem::path& stem, const Page& page) {
    write(stem.string() + ".svg", to_svg(page));
    write(stem.string() + ".png", to_png(page));
}

}  // namespace nbd
