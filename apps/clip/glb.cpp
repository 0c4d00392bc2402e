#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/clip/clip.hpp"
#include "apps/drawing/picture.hpp"
#include "meshing/h5/version.hpp"

namespace nbd {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of the specification.
constexpr int unsigned_int = 5125, single_float = 5126, array_buffer = 34962, element_array_buffer = 34963;

/// More bytes than the description of one frame of a body takes.
constexpr std::int64_t json_of_shape = 1024;

/// A frame of a body as glTF stores it: positions and normals, of morph targets less those of the first.
struct Shape {
    Vertices x, n;
};

/// Reads the frames of one body, one after the other.
class Shapes {
 public:
    Shapes(const Clip& clip, int body) : clip_(clip), body_(body) { first_ = absolute(0); }

    Shape at(int frame) const {
        if (frame == 0) return first_;
        Shape shape = absolute(frame);
        shape.x -= first_.x;
        shape.n -= first_.n;
        return shape;
    }

 private:
    Shape absolute(int frame) const {
        Shape shape;
        clip_.read(body_, frame, shape.x);
        smooth_normals(shape.x, clip_.bodies[body_].F, shape.n);
        return shape;
    }

    const Clip& clip_;
    int body_;
    Shape first_;
};

/// Descriptions of the numbers that follow each other in the binary chunk, each with a view of its own.
class Accessors {
 public:
    /// Returns the number of the accessor. target: of the view; 0: none.
    int add(std::int64_t count, const char* type, int component_type, int target) {
        const std::int64_t bytes = 4 * count * (std::string_view(type) == "VEC3" ? 3 : 1);
        Json view{{"buffer", 0}, {"byteOffset", length_}, {"byteLength", bytes}};
        if (target != 0) view["target"] = target;
        views_.push_back(std::move(view));
        accessors_.push_back({{"bufferView", accessors_.size()},
                              {"componentType", component_type},
                              {"count", count},
                              {"type", type}});
        length_ += bytes;
        return accessors_.size() - 1;
    }

    int add_positions(const Vertices& x) {
        const int accessor = add(x.rows(), "VEC3", single_float, array_buffer);
        const Eigen::RowVector3f low = x.colwise().minCoeff(), high = x.colwise().maxCoeff();
        accessors_.back()["min"] = {low[0], low[1], low[2]};
        accessors_.back()["max"] = {high[0], high[1], high[2]};
        return accessor;
    }

    int add_times(const Clip& clip) {
        const int accessor = add(clip.frames(), "SCALAR", single_float, 0);
        accessors_.back()["min"] = {clip.time(0)};
        accessors_.back()["max"] = {clip.time(clip.frames() - 1)};
        return accessor;
    }

    std::int64_t length() const noexcept { return length_; }
    void put_into(Json& gltf) {
        gltf["accessors"] = std::move(accessors_);
        gltf["bufferViews"] = std::move(views_);
        gltf["buffers"] = Json::array({Json{{"byteLength", length_}}});
    }

 private:
    Json accessors_ = Json::array(), views_ = Json::array();
    std::int64_t length_ = 0;
};

Json material_json(std::size_t body, const std::string& name) {
    Json colour = Json::array();
    for (const float c : body_colours[body % body_colours.size()])
        colour.push_back(c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f));
    colour.push_back(1);
    return {{"name", name},
            {"pbrMetallicRoughness",
             {{"baseColorFactor", std::move(colour)}, {"metallicFactor", 0}, {"roughnessFactor", 0.6}}}};
}

/// Describes the mesh of a body; its numbers are those that write_body() writes.
Json mesh_json(const Clip& clip, int b, Accessors& accessors) {
    const ClipBody& body = clip.bodies[b];
    const Shapes shapes(clip, b);
    Json primitive;
    primitive["indices"] = accessors.add(body.F.size(), "SCALAR", unsigned_int, element_array_buffer);
    primitive["material"] = b;
    Json names = Json::array(), weights = Json::array();
    for (int frame = 0; frame < clip.frames(); ++frame) {
        const Shape shape = shapes.at(frame);
        Json attributes;
        attributes["POSITION"] = accessors.add_positions(shape.x);
        attributes["NORMAL"] = accessors.add(shape.n.rows(), "VEC3", single_float, array_buffer);
        if (frame == 0) {
            primitive["attributes"] = std::move(attributes);
            continue;
        }
        primitive["targets"].push_back(std::move(attributes));
        names.push_back(fmt::format("{:.4f} s", clip.time(frame)));
        weights.push_back(0);
    }
    Json mesh{{"name", body.name}, {"primitives", Json::array({std::move(primitive)})}};
    if (weights.empty()) return mesh;
    mesh["weights"] = std::move(weights);
    mesh["extras"] = {{"targetNames", std::move(names)}};  // which Blender and others show
    return mesh;
}

void write_body(std::ostream& out, const Clip& clip, int b) {
    constexpr std::endian order = std::endian::little;
    const Faces& F = clip.bodies[b].F;
    const Shapes shapes(clip, b);
    write_numbers<order>(out, std::span<const int>(F.data(), F.size()));
    for (int frame = 0; frame < clip.frames(); ++frame) {
        const Shape shape = shapes.at(frame);
        for (const Vertices& numbers : {std::cref(shape.x), std::cref(shape.n)})
            write_numbers<order>(out, std::span<const float>(numbers.data(), numbers.size()));
    }
}

/// One animation for all bodies: at the time of a frame, the weight of its target is 1 and the others are 0.
Json animation_json(const Clip& clip, Accessors& accessors) {
    const int times = accessors.add_times(clip);
    const std::int64_t frames = clip.frames();
    const int weights = accessors.add(frames * (frames - 1), "SCALAR", single_float, 0);
    Json channels = Json::array();
    for (std::size_t b = 0; b < clip.bodies.size(); ++b)
        channels.push_back({{"sampler", 0}, {"target", {{"node", b + 1}, {"path", "weights"}}}});
    Json samplers = Json::array();
    samplers.push_back({{"input", times}, {"interpolation", "LINEAR"}, {"output", weights}});
    return {{"name", clip.title}, {"channels", std::move(channels)}, {"samplers", std::move(samplers)}};
}

void write_animation(std::ostream& out, const Clip& clip) {
    constexpr std::endian order = std::endian::little;
    for (int frame = 0; frame < clip.frames(); ++frame) write_number<order>(out, clip.time(frame));
    for (int frame = 0; frame < clip.frames(); ++frame)
        for (int target = 1; target < clip.frames(); ++target)
            write_number<order>(out, target == frame ? 1.f : 0.f);
}

/// The turned node above all bodies, and theirs.
Json nodes_json(const Clip& clip) {
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(clip.up, Eigen::Vector3d::UnitY());
    Json root{{"name", clip.title}, {"rotation", {turn.x(), turn.y(), turn.z(), turn.w()}}}, nodes;
    if (const Eigen::Vector3d place = turn * clip.origin; !place.isZero(0))
        root["translation"] = {place.x(), place.y(), place.z()};
    for (std::size_t b = 0; b < clip.bodies.size(); ++b) root["children"].push_back(b + 1);
    nodes.push_back(std::move(root));
    for (std::size_t b = 0; b < clip.bodies.size(); ++b)
        nodes.push_back({{"name", clip.bodies[b].name}, {"mesh", b}});
    return nodes;
}

Json gltf_json(const Clip& clip, Accessors& accessors) {
    Json gltf{{"asset", {{"version", "2.0"}, {"generator", fmt::format("nbdtree {}", version())}}},
              {"scene", 0},
              {"scenes", Json::array({Json{{"nodes", Json::array({0})}}})},
              {"nodes", nodes_json(clip)}};
    for (std::size_t b = 0; b < clip.bodies.size(); ++b) {
        gltf["materials"].push_back(material_json(b, clip.bodies[b].name));
        gltf["meshes"].push_back(mesh_json(clip, b, accessors));
    }
    if (clip.frames() > 1) gltf["animations"] = Json::array({animation_json(clip, accessors)});
    accessors.put_into(gltf);
    return gltf;
}

void begin_chunk(std::ostream& out, std::int64_t length, std::uint32_t type) {
    write_number<std::endian::little>(out, static_cast<std::uint32_t>(length));
    write_number<std::endian::little>(out, type);
}

/// Refuses a clip whose file would be longer than its header can say.
void check_size(const Clip& clip) {
    const std::int64_t frames = clip.frames();
    std::int64_t length = 4 * frames * frames;
    for (const ClipBody& body : clip.bodies)
        length += 12 * body.F.rows() + frames * (24 * std::int64_t{body.vertex_count} + json_of_shape);
    if (length > std::numeric_limits<std::uint32_t>::max())
        throw std::invalid_argument(
            fmt::format("{}: would take {:.1f} GB as glTF, which holds 4.3 at most; "
                        "--frames picks fewer of the {} frames",
                        clip.title, 1e-9 * static_cast<double>(length), frames));
}

}  // namespace

void smooth_normals(VerticesRef x, FacesRef F, Vertices& n) {
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sum(x.rows(), 3);
    sum.setZero();
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        const Eigen::RowVector3d a = x.row(F(f, 0)).cast<double>();
        const Eigen::RowVector3d normal =
            (x.row(F(f, 1)).cast<double>() - a).cross(x.row(F(f, 2)).cast<double>() - a);
        for (int c = 0; c < 3; ++c) sum.row(F(f, c)) += normal;
    }
    n.resize(x.rows(), 3);
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
        const double length = sum.row(v).norm();
        n.row(v) = length > 0 ? (sum.row(v) / length).cast<float>().eval() : Eigen::RowVector3f(0, 0, 1);
    }
}

void write_glb(std::ostream& out, const Clip& clip) {
    if (clip.frames() > most_glb_frames)
        throw std::invalid_argument(
            fmt::format("{}: {} frames are too many for glTF, where each is a morph target; allowed: "
                        "at most {}; --frames picks some, a point cache (--mdd, --pc2) holds all",
                        clip.title, clip.frames(), most_glb_frames));
    check_size(clip);
    Accessors accessors;
    std::string json = gltf_json(clip, accessors).dump(-1, ' ', true, Json::error_handler_t::replace);
    json.append((4 - json.size() % 4) % 4, ' ');
    const std::int64_t json_length = json.size();
    const std::int64_t length = 12 + 8 + json_length + 8 + accessors.length();
    out.write("glTF", 4);
    write_number<std::endian::little>(out, std::uint32_t{2});  // version
    write_number<std::endian::little>(out, static_cast<std::uint32_t>(length));
    begin_chunk(out, json_length, 0x4E4F534A);  // "JSON"
    out << json;
    begin_chunk(out, accessors.length(), 0x004E4942);  // "BIN"
    for (int b = 0; b < std::ssize(clip.bodies); ++b) write_body(out, clip, b);
    if (clip.frames() > 1) write_animation(out, clip);
}

}  // namespace nbd
