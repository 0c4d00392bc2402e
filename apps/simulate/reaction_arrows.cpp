#include "apps/simulate/reaction_arrows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "apps/drawing/overlay.hpp"

namespace nbd {
namespace {

const Eigen::Vector3f force_colour{0.73f, 0.11f, 0.11f}, torque_colour{0.43f, 0.16f, 0.85f};
constexpr float arrow_width = 4;      // pixels
constexpr float least_share = 0.01f;  // of the scale, below which nothing is drawn

/// The next number up with few digits.
float round_end(float number) {
    if (!(number > 0)) return 0;
    const float power = std::pow(10.f, std::floor(std::log10(number)));
    for (const float factor : {1.f, 1.5f, 2.f, 3.f, 4.f, 5.f, 6.f, 8.f})
        if (factor * power >= 0.999f * number) return factor * power;
    return 10 * power;
}

/// "5 kN": with the prefix that makes the number one from 1 to 1000.
std::string with_unit(float number, const char* unit) {
    constexpr std::pair<float, const char*> prefixes[]{{1e9f, "G"},  {1e6f, "M"},  {1e3f, "k"}, {1.f, ""},
                                                       {1e-3f, "m"}, {1e-6f, "u"}, {1e-9f, "n"}};
    for (const auto& [size, prefix] : prefixes)
        if (number >= 0.999f * size) return fmt::format("{:.3g} {}{}", number / size, prefix, unit);
    return fmt::format("{:.3g} n{}", number / 1e-9f, unit);
}

}  // namespace

ArrowScale::ArrowScale(std::span<const ViewReaction> all, const Camera& camera, int height)
    : pixels_per_metre_(static_cast<float>(height) / camera.extent), reach_(0.25f * camera.extent) {
    for (const ViewReaction& one : all) {
        force_ = std::max(force_, one.force.norm());
        torque_ = std::max(torque_, one.torque.norm());
    }
    force_ = round_end(force_);
    torque_ = round_end(torque_);
}

void ArrowScale::draw_on(Image& image, std::span<const ViewReaction> reactions, const Camera& camera) const {
    const auto pixel = [&](const Eigen::Vector3f& p) {
        const Eigen::Vector3f q = pixels_per_metre_ * camera.seen(p);
        return Eigen::Vector2f(static_cast<float>(image.width) / 2 + q.x(),
                               static_cast<float>(image.height) / 2 - q.y());
    };
    const auto draw_vector = [&](const Eigen::Vector3f& from, const Eigen::Vector3f& vector, float end,
                                 int heads, const Eigen::Vector3f& colour) {
        if (!(vector.norm() > least_share * end)) return;
        draw_arrow(image, {.from = pixel(from),
                           .to = pixel(from + reach_ / end * vector),
                           .width = arrow_width,
                           .heads = heads,
                           .colour = colour});
    };
    for (const ViewReaction& one : reactions) {
        draw_vector(one.point, one.torque, torque_, 2, torque_colour);
        draw_vector(one.point, one.force, force_, 1, force_colour);
    }
}

void ArrowScale::add_legend(Image& image) const {
    if (force_ == 0 && torque_ == 0) return;
    constexpr int strip = 40, margin = 20, size = 2;
    const int top = image.height, middle = top + strip / 2;
    image.height += strip;
    image.rgb.resize(std::size_t{3} * image.width * image.height, 255);
    const float length = pixels_per_metre_ * reach_;
    int left = margin;
    const auto entry = [&](const std::string& text, int heads, const Eigen::Vector3f& colour) {
        const Eigen::Vector2f from(static_cast<float>(left), static_cast<float>(middle));
        draw_arrow(image, {.from = from,
                           .to = from + Eigen::Vector2f(length, 0),
                           .width = arrow_width,
                           .heads = heads,
                           .colour = colour});
        left += static_cast<int>(length) + 10;
        draw_text(image, left, middle - letter_height * size / 2, text, size);
        left += static_cast<int>(text.size()) * letter_width * size + 2 * margin;
    };
    if (force_ > 0) entry("force " + with_unit(force_, "N"), 1, force_colour);
    if (torque_ > 0) entry("torque " + with_unit(torque_, "N m"), 2, torque_colour);
}

}  // namespace nbd
