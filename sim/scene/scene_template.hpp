#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/scene/scene.hpp"

// Scenes with variables, from which trajectories are drawn.
namespace nbd {

/// A number, or three by their components, between two ends; log: uniform in the logarithm.
struct UniformLaw {
    Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
    bool is_vector = false, is_log = false;
};

/// A whole number between two ends, both included.
struct IntegerLaw {
    long long low = 0, high = 0;
};

/// One of some numbers or texts, each as likely.
struct ChoiceLaw {
    std::vector<nlohmann::json> values{};
};

/// A unit vector at most so many degrees from another, uniform on that part of the sphere.
struct DirectionLaw {
    Eigen::Vector3d about = Eigen::Vector3d::UnitZ();
    double degrees = 180;
};

/// A rotation as `rotate` has it, uniform over all.
struct RotationLaw {};

/// A variable of a scene, and how its value is drawn.
struct SceneVariable {
    std::string key;  // "variables[1]", for messages
    std::string name;
    std::variant<UniformLaw, IntegerLaw, ChoiceLaw, DirectionLaw, RotationLaw> law;
    int copies = 0;  // values, one for each copy of a body; 0: one value for all
};

/// Reads `variables`.
std::vector<SceneVariable> read_variables(JsonObject& from);

/// The variable that stands for the number of a copy of a body, from 0 on.
inline constexpr const char* copy_variable = "copy";
/// Most copies of a body.
inline constexpr int most_copies = 1000;

/// Values of all variables: a JSON object with their names. That of a variable with copies is an object with
/// their numbers: "0", "1", ...
using SceneValues = nlohmann::json;

/// A scene in which {"var": "name"} stands for the value of a variable, times `times` and plus `plus` where
/// they stand beside it. A body with `count`, a number or a variable, stands for so many, in which variables
/// with copies have their own values. With values it is a scene as others.
class SceneTemplate {
 public:
    /// Reads a scene with `variables`. problems: gets one line, JSON path first, for each thing that is wrong
    /// with the variables and their uses. Throws as read_scene().
    SceneTemplate(std::string_view text, std::filesystem::path base, std::vector<std::string>& problems);

    const std::vector<SceneVariable>& variables() const noexcept { return variables_; }
    /// Without `variables`, with what stands for their values.
    const nlohmann::json& scene() const noexcept { return scene_; }
    const std::string& text() const noexcept { return text_; }
    const std::filesystem::path& base() const noexcept { return base_; }

    /// Values of a trajectory, >= 0: a pure function of the variable, the seed and the two numbers, whatever
    /// other variables there are. again: how often it was drawn before.
    SceneValues draw(std::uint64_t seed, int trajectory, int again = 0) const;

    /// Values at the ends of the ranges, and all choices: of one variable after another, the others as drawn
    /// for trajectory 0.
    std::vector<SceneValues> extremes(std::uint64_t seed) const;

    /// Whether a body has `count`.
    bool has_counts() const;
    /// The places in the template's `bodies` of the bodies of the scene with these values.
    std::vector<int> entries_of(const SceneValues& values) const;

    /// Text of the scene with these values, and what parse_scene() and read_scene() make of it.
    std::string text_with(const SceneValues& values) const;
    SceneSpec scene_with(const SceneValues& values) const { return parse_scene(text_with(values), base_); }

 private:
    std::string text_;
    std::filesystem::path base_;
    nlohmann::json scene_;
    std::vector<SceneVariable> variables_;
};

/// Whether a text is a JSON object with `variables`. Throws as read_scene().
bool is_template(std::string_view text);

/// Reads the template at `path`. Throws std::invalid_argument, the path in front, for the first problem.
SceneTemplate load_template(const std::filesystem::path& path);

/// Sets the variables that "name=value" names, JSON or a text. Throws std::invalid_argument for another text,
/// an unknown name or one that occurs twice.
void set_values(const SceneTemplate& scene, const std::vector<std::string>& settings, SceneValues& values);

/// The values in one line, for messages, with four digits: size 0.031, ball "a.obj".
std::string values_text(const SceneValues& values);

/// Whether {"var": ...} stands anywhere in a value.
bool has_variable(const nlohmann::json& value);

}  // namespace nbd
