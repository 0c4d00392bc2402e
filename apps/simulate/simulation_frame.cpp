#include "apps/simulate/simulation_frame.hpp"

#include <cstring>
#include <stdexcept>
#include <tuple>
#include <type_traits>
#include <utility>

namespace nbd {
namespace {

// Members of structs that hold arrays or vectors, in the order in which records have them.
constexpr auto members(const BodyState*) { return std::tuple(&BodyState::x, &BodyState::v); }
constexpr auto members(const PastStep*) {
    return std::tuple(&PastStep::v, &PastStep::inner_forces, &PastStep::held);
}
constexpr auto members(const Momentum*) { return std::tuple(&Momentum::linear, &Momentum::angular); }
constexpr auto members(const JointLoad*) { return std::tuple(&JointLoad::on_a, &JointLoad::on_b); }
constexpr auto members(const Reaction*) {
    return std::tuple(&Reaction::body, &Reaction::by, &Reaction::number, &Reaction::force, &Reaction::torque,
                      &Reaction::point, &Reaction::pressure, &Reaction::volume);
}
constexpr auto members(const StepReactions*) {
    return std::tuple(&StepReactions::frame, &StepReactions::time, &StepReactions::all);
}

template <class T>
concept HasMembers = requires(const T* value) {
    members(value);
};

template <class Archive, class T>
void pass_members(Archive& archive, T& value) {
    std::apply([&](auto... member) { (archive(value.*member), ...); }, members(&value));
}

/// Appends values in this program's memory layout.
class RecordWriter {
 public:
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void operator()(const T& value) { append(&value, sizeof(T)); }

    void operator()(const Eigen::Vector3d& vector) { append(vector.data(), 3 * sizeof(double)); }
    void operator()(const Nodes& rows) {
        (*this)(rows.rows());
        append(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(double));
    }
    template <HasMembers T>
    void operator()(const T& value) {
        pass_members(*this, value);
    }
    template <class T>
    void operator()(const std::vector<T>& values) {
        (*this)(values.size());
        for (const T& value : values) (*this)(value);
    }

    const std::string& bytes() const noexcept { return bytes_; }

 private:
    void append(const void* from, std::size_t size) { bytes_.append(static_cast<const char*>(from), size); }

    std::string bytes_;
};

/// Reads what a RecordWriter of the same program wrote, in the same order. Throws std::runtime_error if the
/// bytes end too soon.
class RecordReader {
 public:
    explicit RecordReader(std::string_view bytes) : left_(bytes) {}

    template <class T>
    requires std::is_trivially_copyable_v<T>
    void operator()(T& value) { take(&value, sizeof(T)); }

    void operator()(Eigen::Vector3d& vector) { take(vector.data(), 3 * sizeof(double)); }
    void operator()(Nodes& rows) {
        rows.resize(count(3 * sizeof(double)), 3);
        take(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(double));
    }
    template <HasMembers T>
    void operator()(T& value) {
        pass_members(*this, value);
    }
    template <class T>
    void operator()(std::vector<T>& values) {
        values.resize(count(1));
        for (T& value : values) (*this)(value);
    }

 private:
    /// A number of things that take so many bytes each at least, and are there.
    std::size_t count(std::size_t bytes) {
        std::size_t number = 0;
        (*this)(number);
        if (number > left_.size() / bytes) refuse();
        return number;
    }
    [[noreturn]] static void refuse() { throw std::runtime_error("a record of the journal is too short"); }
    void take(void* to, std::size_t size) {
        if (size > left_.size()) refuse();
        if (size > 0) std::memcpy(to, left_.data(), size);
        left_.remove_prefix(size);
    }

    std::string_view left_;
};

/// Passes all that a record holds to a RecordWriter or a RecordReader. frame: SimulationFrame, const for a
/// RecordWriter.
template <class Archive, class Frame>
void pass(Archive& archive, Frame& frame) {
    auto& world = frame.world;
    archive(frame.number);
    archive(world.time);
    archive(world.dt_before);
    archive(world.bodies);
    archive(world.inner_forces);
    archive(world.before);
    archive(world.stretches.contacts);
    archive(world.stretches.ways);
    archive(world.taken_at);
    archive(world.broken);
    archive(world.springs_before);
    archive(frame.contact_forces);
    archive(frame.steps);
    archive(frame.reactions);
}

}  // namespace

SimulationFrame take_frame(int number, const World& world, std::vector<StepRow> steps,
                           std::vector<StepReactions> reactions) {
    SimulationFrame frame{.number = number,
                          .world = world.snapshot(),
                          .contact_forces = {},
                          .steps = std::move(steps),
                          .reactions = std::move(reactions)};
    for (int b = 0; b < world.body_count(); ++b) frame.contact_forces.push_back(world.contact_forces(b));
    return frame;
}

std::string to_bytes(const SimulationFrame& frame) {
    RecordWriter writer;
    pass(writer, frame);
    return writer.bytes();
}

SimulationFrame frame_from(std::string_view bytes) {
    RecordReader reader(bytes);
    SimulationFrame frame;
    pass(reader, frame);
    return frame;
}

}  // namespace nbd
