#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <variant>

namespace nbd {

/// A force on a body of a recorded scene, a mean over a step.
struct RecordedReaction {
    int frame = 0;                                     // that the step belongs to
    double time = 0;                                   // end of the step, seconds
    int body = 0;                                      // id of the trajectory that it acts on
    std::string kind, by;                              // of what exerts it, and its name in the scene
    Eigen::Vector3d force = Eigen::Vector3d::Zero();   // N
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // about zero of the scene's coordinates, N m
    double pressure = 0, volume = 0;                   // of a cavity, Pa and m3
    Eigen::Vector3d point = Eigen::Vector3d::Zero();   // where the force acts, in the scene's coordinates, m

    bool is_of_cavity() const { return kind == "cavity"; }
    bool operator==(const RecordedReaction&) const = default;
};

/// A column of a table of reactions, in files of CSV and in recordings.
struct ReactionColumn {
    template <class T>
    using Member = T RecordedReaction::*;
    enum class Of { all, forces, cavities };

    const char* name;
    std::variant<Member<int>, Member<double>, Member<std::string>, Member<Eigen::Vector3d>> value;
    Of of = Of::all;  // which rows have it

    bool is_in(const RecordedReaction& row) const {
        return of == Of::all || row.is_of_cavity() == (of == Of::cavities);
    }
};

inline constexpr std::array<ReactionColumn, 10> reaction_columns{
    {{"frame", &RecordedReaction::frame},
     {"time", &RecordedReaction::time},
     {"body", &RecordedReaction::body},
     {"kind", &RecordedReaction::kind},
     {"by", &RecordedReaction::by},
     {"force", &RecordedReaction::force},
     {"torque", &RecordedReaction::torque},
     {"pressure", &RecordedReaction::pressure, ReactionColumn::Of::cavities},
     {"volume", &RecordedReaction::volume, ReactionColumn::Of::cavities},
     {"point", &RecordedReaction::point, ReactionColumn::Of::forces}}};

}  // namespace nbd
