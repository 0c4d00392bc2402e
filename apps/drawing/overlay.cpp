#include "apps/drawing/overlay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace nbd {
namespace {

struct Glyph {
    char letter;
    std::array<std::uint8_t, 7> rows;  // from the top; five bits each, the highest is the left one
};

constexpr Glyph glyphs[]{{'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},
                         {'2', {14, 17, 1, 2, 4, 8, 31}},     {'3', {31, 2, 4, 2, 1, 17, 14}},
                         {'4', {2, 6, 10, 18, 31, 2, 2}},     {'5', {31, 16, 30, 1, 1, 17, 14}},
                         {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},
                         {'8', {14, 17, 17, 14, 17, 17, 14}}, {'9', {14, 17, 17, 15, 1, 2, 12}},
                         {'.', {0, 0, 0, 0, 0, 12, 12}},      {'G', {14, 17, 16, 23, 17, 17, 15}},
                         {'M', {17, 27, 21, 21, 17, 17, 17}}, {'N', {17, 17, 25, 21, 19, 17, 17}},
                         {'c', {0, 0, 14, 16, 16, 17, 14}},   {'e', {0, 0, 14, 17, 31, 16, 14}},
                         {'f', {6, 9, 8, 28, 8, 8, 8}},       {'k', {16, 16, 18, 20, 24, 20, 18}},
                         {'m', {0, 0, 26, 21, 21, 17, 17}},   {'n', {0, 0, 22, 25, 17, 17, 17}},
                         {'o', {0, 0, 14, 17, 17, 17, 14}},   {'q', {0, 0, 13, 19, 15, 1, 1}},
                         {'r', {0, 0, 22, 25, 16, 16, 16}},   {'t', {8, 8, 28, 8, 8, 9, 6}},
                         {'u', {0, 0, 17, 17, 17, 19, 13}}};

/// Mixes a colour into a pixel. share: of the colour.
void mix(Image& image, int x, int y, const Eigen::Vector3f& colour, float share) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    std::uint8_t* pixel = &image.rgb[3 * (static_cast<std::size_t>(y) * image.width + x)];
    for (int c = 0; c < 3; ++c)
        pixel[c] = static_cast<std::uint8_t>(
            std::lround((1 - share) * static_cast<float>(pixel[c]) + share * 255 * colour[c]));
}

/// An arrow in coordinates along it and across.
struct ArrowShape {
    float length, half_width, head;
    int heads;

    /// Whether it holds a point once it has grown by `seam`.
    bool holds(float along, float across, float seam) const {
        const float aside = std::abs(across);
        if (along >= -seam && along <= length - head && aside <= half_width + seam) return true;
        for (int k = 0; k < heads; ++k) {
            const float tip = length - static_cast<float>(k) * head, back = tip - along;  // behind the tip
            constexpr float slope = 0.45f;
            if (back >= -2 * seam && back <= head + seam && aside <= slope * (back + 2 * seam)) return true;
        }
        return false;
    }
};

}  // namespace

void draw_arrow(Image& image, const OverlayArrow& arrow) {
    const Eigen::Vector2f way = arrow.to - arrow.from;
    const float length = way.norm();
    if (!(length > 0.5f)) return;
    const Eigen::Vector2f along = way / length, across(-along.y(), along.x());
    const float head = std::min(5 * arrow.width, 0.8f * length / static_cast<float>(arrow.heads));
    const ArrowShape shape{length, std::min(0.5f * arrow.width, 0.15f * head), head, arrow.heads};
    const float room = head + 3;
    const Eigen::Vector2f low = arrow.from.cwiseMin(arrow.to).array() - room,
                          high = arrow.from.cwiseMax(arrow.to).array() + room;
    const auto cut = [](float v, int limit) {
        return static_cast<int>(std::clamp(v, 0.f, static_cast<float>(limit)));
    };
    constexpr int samples = 4;
    for (int y = cut(low.y(), image.height); y < cut(high.y() + 1, image.height); ++y)
        for (int x = cut(low.x(), image.width); x < cut(high.x() + 1, image.width); ++x) {
            int inside = 0, about = 0;
            for (int k = 0; k < samples * samples; ++k) {
                const Eigen::Vector2f p =
                    Eigen::Vector2f(
                        static_cast<float>(x) + (static_cast<float>(k % samples) + 0.5f) / samples,
                        static_cast<float>(y) + (static_cast<float>(k / samples) + 0.5f) / samples) -
                    arrow.from;
                inside += shape.holds(p.dot(along), p.dot(across), 0);
                about += shape.holds(p.dot(along), p.dot(across), 1);
            }
            constexpr float all = samples * samples;
            mix(image, x, y, Eigen::Vector3f::Ones(), static_cast<float>(about) / all);
            mix(image, x, y, arrow.colour, static_cast<float>(inside) / all);
        }
}

void draw_text(Image& image, int left, int top, std::string_view text, int size) {
    const Eigen::Vector3f ink(0.1f, 0.12f, 0.2f);
    for (const char letter : text) {
        const auto* glyph = std::ranges::find(glyphs, letter, &Glyph::letter);
        if (glyph != std::end(glyphs))
            for (int y = 0; y < letter_height * size; ++y)
                for (int x = 0; x < (letter_width - 1) * size; ++x)
                    if ((glyph->rows[y / size] >> (4 - x / size) & 1) != 0)
                        mix(image, left + x, top + y, ink, 1);
        left += letter_width * size;
    }
}

}  // namespace nbd
