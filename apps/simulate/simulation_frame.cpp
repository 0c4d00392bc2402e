#include "apps/simulate/simulation_frame.hpp"

#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace nbd {
namespace {

/// Concatenates plain values in this program's memory layout.
class ByteWriter {
 public:
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void put(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T)); }

    template <class T>
    void put_all(const std::vector<T>& values) {
        put(values.size());
        for (const T& value : values) put(value);
    }

    void put_nodes(const Nodes& rows) {
        put(rows.rows());
        bytes_.append(reinterpret_cast<const char*>(rows.data()),
                      static_cast<std::size_t>(rows.size()) * sizeof(double));
    }

    const std::string& bytes() const noexcept { return bytes_; }

 private:
    std::string bytes_;
};

/// Reads values that a ByteWriter of the same program wrote, in the same order. Throws std::runtime_error if
/// the bytes end too soon.
class ByteReader {
 public:
    explicit ByteReader(std::string_view bytes) : left_(bytes) {}

    template <class T>
    requires std::is_trivially_copyable_v<T> T get() {
        T value;
        take(&value, sizeof(T));
        return value;
    }

    template <class T>
    std::vector<T> get_all() {
        std::vector<T> values;
        for (auto count = get<std::size_t>(); count > 0; --count) values.push_back(get<T>());
        return values;
    }

    Nodes get_nodes() {
        const auto count = get<Eigen::Index>();
        if (count < 0 || static_cast<std::size_t>(count) > left_.size() / (3 * sizeof(double))) refuse();
        Nodes rows(count, 3);
        take(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(double));
        return rows;
    }

 private:
    [[noreturn]] static void refuse() { throw std::runtime_error("a record of the journal is too short"); }
    void take(void* to, std::size_t size) {
        if (size > left_.size()) refuse();
        if (size > 0) std::memcpy(to, left_.data(), size);
        left_.remove_prefix(size);
    }

    std::string_view left_;
};

/// The vectors as rows of a matrix, since Eigen vectors are not plain values.
Nodes rows_of(const std::vector<Eigen::Vector3d>& vectors) {
    Nodes rows(vectors.size(), 3);
    for (std::size_t i = 0; i < vectors.size(); ++i) rows.row(i) = vectors[i];
    return rows;
}

}  // namespace

SimulationFrame take_frame(int number, const World& world, std::vector<StepRow> steps) {
    SimulationFrame frame{
        .number = number, .world = world.snapshot(), .contact_forces = {}, .steps = std::move(steps)};
    for (int b = 0; b < world.body_count(); ++b) frame.contact_forces.push_back(world.contact_forces(b));
    return frame;
}

std::string to_bytes(const SimulationFrame& frame) {
    ByteWriter out;
    out.put(frame.number);
    out.put(frame.world.time);
    out.put(frame.world.dt_before);
    out.put(frame.world.bodies.size());
    for (const auto* states : {&frame.world.bodies, &frame.world.before})
        for (const BodyState& body : *states) {
            out.put_nodes(body.x);
            out.put_nodes(body.v);
        }
    for (const Nodes& velocities : frame.world.velocities_before) out.put_nodes(velocities);
    out.put_all(frame.world.sides.vertices);
    out.put_nodes(rows_of(frame.world.sides.normals));
    out.put_all(frame.world.sides.depths);
    out.put_all(frame.world.sides.starts.vertices);
    out.put_all(frame.world.sides.starts.depths);
    out.put(frame.world.sides.starts.bodies);
    out.put(frame.world.sides.starts.obstacles);
    for (const Nodes& forces : frame.contact_forces) out.put_nodes(forces);
    out.put_all(frame.steps);
    return out.bytes();
}

SimulationFrame frame_from(std::string_view bytes) {
    ByteReader in(bytes);
    SimulationFrame frame;
    frame.number = in.get<int>();
    frame.world.time = in.get<double>();
    frame.world.dt_before = in.get<double>();
    const auto bodies = in.get<std::size_t>();
    for (auto* states : {&frame.world.bodies, &frame.world.before})
        for (std::size_t b = 0; b < bodies; ++b) {
            Nodes x = in.get_nodes();
            states->push_back({std::move(x), in.get_nodes()});
        }
    for (std::size_t b = 0; b < bodies; ++b) frame.world.velocities_before.push_back(in.get_nodes());
    frame.world.sides.vertices = in.get_all<std::array<int, 3>>();
    const Nodes normals = in.get_nodes();
    for (Eigen::Index i = 0; i < normals.rows(); ++i) frame.world.sides.normals.emplace_back(normals.row(i));
    frame.world.sides.depths = in.get_all<double>();
    frame.world.sides.starts.vertices = in.get_all<std::array<int, 3>>();
    frame.world.sides.starts.depths = in.get_all<double>();
    frame.world.sides.starts.bodies = in.get<int>();
    frame.world.sides.starts.obstacles = in.get<int>();
    for (std::size_t b = 0; b < bodies; ++b) frame.contact_forces.push_back(in.get_nodes());
    frame.steps = in.get_all<StepRow>();
    return frame;
}

}  // namespace nbd
