#include "apps/view/page.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

#include "apps/view/packed.hpp"
#include "apps/view/page_texts.hpp"
#include "meshing/h5/version.hpp"

namespace nbd {
namespace {

using Json = nlohmann::ordered_json;

/// Whole steps of scalars: more than a colour can show, and fewer random bits than 65535.
constexpr int scalar_steps = 4095;

Json as_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// The data of a page: packed numbers, in elements of their own or in the JSON, and what refers to them.
class PageData {
 public:
    explicit PageData(bool in_elements) : in_elements_(in_elements) {}

    Json add(Packed packed) {
        Json entry{{"type", packed.type},     {"count", packed.count}, {"row", packed.row},
                   {"stride", packed.stride}, {"time", packed.time},   {"space", packed.space}};
        if (!in_elements_) {
            entry["text"] = std::move(packed.text);
            return entry;
        }
        entry["id"] = fmt::format("d{}", texts_.size());
        texts_.push_back(std::move(packed.text));
        return entry;
    }

    Json add(std::span<const std::uint32_t> numbers) {
        return add(pack(numbers, std::max<std::size_t>(numbers.size(), 1), 1));
    }

    /// Numbers of several frames, `columns` for each thing.
    Json add_quantised(std::span<const float> numbers, std::size_t frames, int columns, int steps) {
        const Quantised q = quantise(numbers, columns, steps);
        const std::size_t row = std::max<std::size_t>(numbers.size() / std::max<std::size_t>(frames, 1), 1);
        return {{"low", q.low}, {"step", q.step}, {"data", add(pack(q.values, row, columns))}};
    }

    Json add_faces(const Faces& F) {
        const std::vector<std::uint32_t> corners(F.data(), F.data() + F.size());
        return add(pack(corners, 3, 3));
    }

    Json add_positions(const Vertices& x) { return add(pack(std::span(x.data(), x.size()))); }

    const std::vector<std::string>& texts() const noexcept { return texts_; }

 private:
    bool in_elements_;
    std::vector<std::string> texts_;
};

Json embedding_json(const SurfaceEmbedding& W, PageData& data) {
    if (W.rows() == 0) return nullptr;
    std::vector<std::uint32_t> counts, columns;
    std::vector<float> weights;
    for (Eigen::Index v = 0; v < W.rows(); ++v) {
        std::uint32_t count = 0;
        for (SurfaceEmbedding::InnerIterator entry(W, v); entry; ++entry, ++count) {
            columns.push_back(entry.col());
            weights.push_back(entry.value());
        }
        counts.push_back(count);
    }
    return {
        {"counts", data.add(counts)}, {"columns", data.add(columns)}, {"weights", data.add(pack(weights))}};
}

Json marks_json(const FaceMarks& marks, PageData& data) {
    if (marks.faces.empty()) return nullptr;
    return {{"counts", data.add(marks.counts)}, {"faces", data.add(marks.faces)}};
}

/// What is the same in all frames.
Json fixed_json(const ViewBody& body, std::size_t frames, PageData& data) {
    return {{"name", body.name},
            {"nodeCount", body.nodes.rows() / static_cast<Eigen::Index>(std::max<std::size_t>(frames, 1))},
            {"faces", data.add_faces(body.F)},
            {"embedding", embedding_json(body.W, data)},
            {"start", body.start.rows() > 0 ? data.add_positions(body.start) : Json()}};
}

/// Adds what the frames hold.
void add_frames(const ViewBody& body, std::size_t frames, PageData& data, Json& json) {
    const std::span nodes(body.nodes.data(), body.nodes.size());
    json["nodes"] = data.add_quantised(nodes, frames, 3, 65535);
    json["scalars"] = Json::array();
    for (const NodeScalar& scalar : body.scalars) {
        Json entry = data.add_quantised(scalar.values, frames, 1, scalar_steps);
        entry["name"] = scalar.name;
        json["scalars"].push_back(std::move(entry));
    }
    json["marks"] = {{"near", marks_json(body.near, data)},
                     {"intersecting", marks_json(body.intersecting, data)},
                     {"missed", marks_json(body.missed, data)}};
    if (!body.bounds) return;
    Json bounds = data.add_quantised(body.bounds->values, frames, body.bounds->are_boxes ? 6 : 4, 65535);
    bounds["kind"] = body.bounds->kind;
    bounds["boxes"] = body.bounds->are_boxes;
    bounds["firstNode"] = body.bounds->first_node;
    json["bounds"] = std::move(bounds);
}

/// Where an obstacle is in every frame, as three.js places a group.
void add_places(const ViewObstacle& obstacle, Json& json) {
    Json shifts = Json::array(), turns = Json::array(), scales = Json::array();
    for (const Placing& placing : obstacle.places) {
        const Eigen::Quaterniond turn(placing.turn);
        shifts.push_back(as_json(placing(Eigen::Vector3d::Zero())));
        turns.push_back({turn.x(), turn.y(), turn.z(), turn.w()});
        scales.push_back(placing.scale);
    }
    json["shifts"] = std::move(shifts);
    json["turns"] = std::move(turns);
    json["scales"] = std::move(scales);
}

Json obstacle_json(const ViewObstacle& shown, PageData& data) {
    Json json;
    const auto& shape = shown.obstacle.shape;
    if (const auto* plane = std::get_if<PlaneShape>(&shape))
        json = {{"shape", "plane"}, {"point", as_json(plane->point)}, {"normal", as_json(plane->normal)}};
    else if (const auto* ball = std::get_if<BallShape>(&shape))
        json = {{"shape", "ball"}, {"centre", as_json(ball->centre)}, {"radius", ball->radius}};
    else {
        const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(shape)->mesh();
        json = {{"shape", "mesh"},
                {"positions", data.add_positions(mesh.X.cast<float>())},
                {"faces", data.add_faces(mesh.F)}};
        if (const SurfaceFrames* frames = shown.obstacle.frames.get()) {
            Vertices all(std::ssize(frames->times) * mesh.X.rows(), 3);
            for (std::size_t k = 0; k < frames->times.size(); ++k)
                all.middleRows(static_cast<Eigen::Index>(k) * mesh.X.rows(), mesh.X.rows()) =
                    frames->positions[k].cast<float>();
            json["frames"] = {{"times", frames->times}, {"positions", data.add_positions(all)}};
        }
    }
    add_places(shown, json);
    return json;
}

/// The largest number, and the one that one positive number in 200 exceeds, as the end of a scale that few
/// outliers shall not stretch.
Json range_json(std::vector<float> numbers) {
    std::erase_if(numbers, [](float number) { return number <= 0; });
    if (numbers.empty()) return {{"max", 0}, {"usual", 0}};
    const auto usual =
        numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() - 1 - numbers.size() / 200);
    std::ranges::nth_element(numbers, usual);
    return {{"max", *std::max_element(usual, numbers.end())}, {"usual", *usual}};
}

std::vector<float> displacements(const ViewBody& body) {
    std::vector<float> result;
    const Eigen::Index count = body.start.rows();
    for (Eigen::Index i = 0; count > 0 && i < body.nodes.rows(); ++i)
        result.push_back((body.nodes.row(i) - body.start.row(i % count)).norm());
    return result;
}

/// The scalars that colours can show, each with the range that all bodies have.
Json scalars_json(const ViewScene& scene) {
    struct Scalar {
        std::string name, unit;
        std::vector<float> values{};
    };
    std::vector<Scalar> found;
    const auto add = [&](const std::string& name, const std::string& unit, const std::vector<float>& values) {
        auto entry = std::ranges::find(found, name, &Scalar::name);
        if (entry == found.end()) entry = found.insert(found.end(), Scalar{name, unit});
        entry->values.insert(entry->values.end(), values.begin(), values.end());
    };
    for (const ViewBody& body : scene.bodies) {
        if (body.start.rows() > 0) add("displacement", "m", displacements(body));
        for (const NodeScalar& scalar : body.scalars) add(scalar.name, scalar.unit, scalar.values);
    }
    Json json = Json::array();
    for (Scalar& scalar : found) {
        Json entry = range_json(std::move(scalar.values));
        entry["name"] = scalar.name;
        entry["unit"] = scalar.unit;
        json.push_back(std::move(entry));
    }
    return json;
}

/// Reactions as arrows need them: nine numbers each, of the point, the force and the torque.
Json reactions_json(const ViewScene& scene, PageData& data) {
    if (!scene.has_reactions) return nullptr;
    std::vector<std::uint32_t> counts, bodies;
    std::vector<float> numbers;
    for (const std::vector<ViewReaction>& frame : scene.reactions) {
        counts.push_back(static_cast<std::uint32_t>(frame.size()));
        for (const ViewReaction& one : frame) {
            bodies.push_back(one.body);
            for (const Eigen::Vector3f& vector : {one.point, one.force, one.torque})
                numbers.insert(numbers.end(), vector.begin(), vector.end());
        }
    }
    return {{"counts", data.add(counts)}, {"bodies", data.add(bodies)}, {"numbers", data.add(pack(numbers))}};
}

Json pairs_json(const std::vector<PairCounts>& pairs) {
    const auto list = [&](std::uint32_t PairCounts::*count) {
        Json numbers = Json::array();
        for (const PairCounts& frame : pairs) numbers.push_back(frame.*count);
        return numbers;
    };
    return {{"intersecting", list(&PairCounts::intersecting)},
            {"near", list(&PairCounts::near)},
            {"intersectingMissed", list(&PairCounts::intersecting_missed)},
            {"nearMissed", list(&PairCounts::near_missed)}};
}

Json facts_json(const ViewScene& scene, PageData& data) {
    Json json{{"title", scene.title},
              {"program", fmt::format("nbdtree {}", version())},
              {"displacementFrom", scene.displacement_from},
              {"up", as_json(scene.up)},
              {"times", scene.times},
              {"numbers", scene.numbers},
              {"recordedFrames", scene.recorded_frames},
              {"contactDistance", scene.contact_distance},
              {"audited", scene.is_audited},
              {"scalars", scalars_json(scene)},
              {"pairs", pairs_json(scene.pairs)},
              {"reactions", reactions_json(scene, data)},
              {"bodies", Json::array()},
              {"obstacles", Json::array()}};
    for (const ViewBody& body : scene.bodies) {
        json["bodies"].push_back(fixed_json(body, scene.frames(), data));
        add_frames(body, scene.frames(), data, json["bodies"].back());
    }
    for (const ViewObstacle& obstacle : scene.obstacles)
        json["obstacles"].push_back(obstacle_json(obstacle, data));
    return json;
}

/// JSON text that may stand inside a script element: names may hold "</script>".
std::string inside_script(const Json& json) {
    std::string text;
    for (const char c : json.dump(-1, ' ', true))
        text += c == '<' ? std::string("\\u003c") : std::string(1, c);
    return text;
}

/// Writes `text` up to the marker, and cuts both off.
void write_until(std::ostream& out, std::string_view& text, std::string_view marker) {
    const std::size_t at = text.find(marker);
    out << text.substr(0, at);
    text.remove_prefix(at + marker.size());
}

}  // namespace

void write_page(std::ostream& out, const ViewScene& scene, const std::optional<LivePage>& live) {
    PageData data(true);
    Json facts = facts_json(scene, data);
    if (live) facts["live"] = {{"run", live->run}, {"frames", live->frames}, {"seconds", live->seconds}};
    std::string_view html = page_texts::page_html();
    write_until(out, html, "{{connect}}");
    if (live) out << "; connect-src 'self'";
    write_until(out, html, "{{style}}");
    out << "<style>\n" << page_texts::page_css() << "</style>\n";
    write_until(out, html, "{{data}}");
    out << "<script type=\"application/json\" id=\"facts\">" << inside_script(facts) << "</script>\n";
    for (std::size_t i = 0; i < data.texts().size(); ++i)
        out << "<script type=\"text/plain\" id=\"d" << i << "\">" << data.texts()[i] << "</script>\n";
    write_until(out, html, "{{scripts}}");
    out << "<!--\n" << page_texts::three_licence() << "-->\n";
    for (const std::string_view library : {page_texts::three_js(), page_texts::orbit_controls_js()})
        out << "<script>\n" << library << "</script>\n";
    for (const auto& [name, text] : page_texts::scripts())
        out << "<script>\n// " << name << '\n' << text << "</script>\n";
    out << html;
}

std::string frames_text(const ViewScene& scene) {
    PageData data(false);
    Json json{{"times", scene.times},
              {"numbers", scene.numbers},
              {"scalars", scalars_json(scene)},
              {"pairs", pairs_json(scene.pairs)},
              {"reactions", reactions_json(scene, data)},
              {"bodies", Json::array()},
              {"places", Json::array()}};
    for (const ViewBody& body : scene.bodies) {
        json["bodies"].emplace_back();
        add_frames(body, scene.frames(), data, json["bodies"].back());
    }
    for (const ViewObstacle& obstacle : scene.obstacles) {
        json["places"].emplace_back();
        add_places(obstacle, json["places"].back());
    }
    return json.dump(-1, ' ', true);
}

}  // namespace nbd
