#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/dataset/variety.hpp"

namespace nbd {
namespace {

/// The counts of frames of a kind, and their keys.
struct FrameCount {
    const char* key;
    long KindVariety::*count;
};
constexpr FrameCount frame_counts[]{{"frames", &KindVariety::frames},
                                    {"frames_in_contact", &KindVariety::frames_in_contact},
                                    {"frames_troubled", &KindVariety::frames_troubled},
                                    {"frames_self_intersecting", &KindVariety::frames_self_intersecting}};

void write_frames(nlohmann::ordered_json& json, const KindVariety& kind) {
    for (const FrameCount& f : frame_counts) json[f.key] = kind.*f.count;
}

/// Manifests of earlier versions have fewer counts.
void read_frames(const nlohmann::json& json, KindVariety& kind) {
    kind.frames = json.at("frames");
    for (const FrameCount& f : frame_counts) kind.*f.count = json.value(f.key, 0L);
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

}  // namespace

std::string to_json(const Variety& v) {
    nlohmann::ordered_json json;
    json["kinds"] = nlohmann::ordered_json::object();
    for (const auto& [name, kind] : v.kinds) {
        nlohmann::ordered_json& entry = json["kinds"][name];
        entry = {{"trajectories", kind.trajectories}, {"failed", kind.failed}};
        write_frames(entry, kind);
    }
    write_frames(json, v.all);
    json["sampled_frames"] = v.sampled;
    json["stretch_quantiles"] = variety_quantiles;
    json["stretch"] = v.stretch;
    json["least_stretch"] = v.least_stretch;
    json["largest_stretch"] = v.largest_stretch;
    json["body_length"] = v.body_length;
    json["displacement"] = v.displacement;
    json["mode_std"] = v.mode_std;
    json["mode_share"] = v.mode_share;
    json["frequencies_hz"] = v.frequencies;
    return json.dump();
}

Variety variety_from_json(const std::string& text) try {
    const nlohmann::json json = nlohmann::json::parse(text);
    Variety v;
    for (const auto& [name, entry] : json.at("kinds").items()) {
        KindVariety& kind = v.kinds[name];
        kind = {.trajectories = entry.at("trajectories"), .failed = entry.at("failed")};
        read_frames(entry, kind);
        v.all += kind;
    }
    json.at("sampled_frames").get_to(v.sampled);
    json.at("stretch").get_to(v.stretch);
    json.at("least_stretch").get_to(v.least_stretch);
    json.at("largest_stretch").get_to(v.largest_stretch);
    json.at("body_length").get_to(v.body_length);
    json.at("displacement").get_to(v.displacement);
    json.at("mode_std").get_to(v.mode_std);
    json.at("mode_share").get_to(v.mode_share);
    json.at("frequencies_hz").get_to(v.frequencies);
    if ((!v.stretch.empty() && v.stretch.size() != variety_quantiles.size()) ||
        v.mode_std.size() != v.mode_share.size() ||
        (!v.mode_std.empty() && v.frequencies.size() != v.mode_std.size()))
        throw std::invalid_argument("its lists have other lengths than nbdtree writes");
    return v;
} catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(error.what());
}

std::string to_text(const Variety& v) {
    std::string text = fmt::format("{:10}{:>13}{:>8}{:>8}{:>12}{:>12}{:>19}\n", "kind", "trajectories",
                                   "failed", "frames", "in contact", "troubled", "self-intersecting");
    const auto out = std::back_inserter(text);
    const auto row = [&](const std::string& name, const KindVariety& kind) {
        fmt::format_to(
            out, "{:10}{:>13}{:>8}{:>8}{:>10.1f} %{:>10.1f} %{:>17.1f} %\n", name, kind.trajectories,
            kind.failed, kind.frames, percent(kind.frames_in_contact, kind.frames),
            percent(kind.frames_troubled, kind.frames), percent(kind.frames_self_intersecting, kind.frames));
    };
    for (const auto& [name, kind] : v.kinds) row(name, kind);
    row("all", v.all);
    if (v.stretch.empty()) return text;
    fmt::format_to(out, "principal stretches ({} frames):", v.sampled);
    for (std::size_t i = 0; i < v.stretch.size(); ++i)
        fmt::format_to(out, " {:.3g} % below {:.3f},", 100 * variety_quantiles[i], v.stretch[i]);
    fmt::format_to(out, " all from {:.3f} to {:.3f}\n", v.least_stretch, v.largest_stretch);
    fmt::format_to(out, "displacement without rigid motion: {:.2f} % of the body's length\n",
                   percent(v.displacement, v.body_length));
    if (v.mode_std.empty()) {
        fmt::format_to(out, "no modal coordinates: the body has no modes");
        return text;
    }
    fmt::format_to(out, "share of it in the first modes:");
    for (std::size_t count = 1; count < v.mode_share.size(); count *= 2)
        fmt::format_to(out, " {}: {:.1f} %,", count, 100 * v.mode_share[count - 1]);
    fmt::format_to(out, " all {}: {:.1f} %\n", v.mode_share.size(), 100 * v.mode_share.back());
    fmt::format_to(out, "spread of modal coordinates, % of the body's length:");
    for (std::size_t k = 0; k < std::min<std::size_t>(8, v.mode_std.size()); ++k)
        fmt::format_to(out, " {:.2f}", percent(v.mode_std[k], v.body_length));
    if (v.mode_std.size() > 8) fmt::format_to(out, " ... {:.3f}", percent(v.mode_std.back(), v.body_length));
    return text;
}

std::string to_csv(const Variety& v) {
    std::string text = "mode,frequency_hz,std_m,share_of_squared_displacement\n";
    for (std::size_t k = 0; k < v.mode_std.size(); ++k)
        fmt::format_to(std::back_inserter(text), "{},{},{},{}\n", k, v.frequencies[k], v.mode_std[k],
                       v.mode_share[k] - (k > 0 ? v.mode_share[k - 1] : 0));
    return text;
}

}  // namespace nbd
