// How a recipe is drawn.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/base/stop.hpp"
#include "sim/excitation/recipe.hpp"

namespace nbd {
namespace {

/// Strain to which bodies are bent at most that are folded or curled.
constexpr double most_bend_strain = 0.5;

/// Kind of a trajectory, by a low-discrepancy sequence, so that any run of consecutive trajectories follows
/// the mix.
RecipeKind kind_of(const std::array<double, recipe_kinds>& mix, std::uint64_t seed, int index) {
    const double turn = (std::numbers::phi - 1) * index + counter_uniform(seed, 0, 0);
    double u = turn - std::floor(turn);
    int last = 0;
    for (int k = 0; k < std::ssize(mix); ++k) {
        const double share = mix[k];
        if (share <= 0) continue;
        if (u < share) return static_cast<RecipeKind>(k);
        u -= share;
        last = k;
    }
    return static_cast<RecipeKind>(last);  // reached only by rounding
}

double draw(CounterRandom& random, const Range& range) { return random.uniform(range.from, range.to); }

Eigen::Vector3d random_perpendicular(CounterRandom& random, const Eigen::Vector3d& axis) {
    const Eigen::Vector3d d = random.direction();
    return (d - d.dot(axis) * axis).stableNormalized();
}

/// Draws one recipe. The members are shared by all ingredients.
class Draw {
 public:
    Draw(const Body& body, const LocalThickness& thickness, const NaturalScales& scales,
         const ExcitationConfig& config, double frame_interval, int index)
        : body_(body),
          thickness_(thickness),
          scales_(scales),
          ranges_(config.ranges),
          strength_(config.ranges.strength * scales.sturdiness),
          random_(config.seed, static_cast<std::uint64_t>(index)) {
        recipe_.kind = kind_of(recipe_mix(ranges_), config.seed, index);
        recipe_.frame_interval = frame_interval;
        recipe_.rotation = random_.orientation().toRotationMatrix();
        recipe_.first_frame = draw(random_, ranges_.warm_up) * scales_.time;
        duration_ = recipe_.first_frame + recipe_.frame_interval * config.frames;
        const Eigen::RowVector3d centroid = body.tets.X.colwise().mean();
        x_ = (body.tets.X.rowwise() - centroid) * recipe_.rotation.transpose();
    }

    Recipe run() {
        const KindRanges& kind = ranges_.kinds[static_cast<std::size_t>(recipe_.kind)];
        add_gradient(kind.gradient);
        switch (recipe_.kind) {
            case RecipeKind::drop:
                add_floor();
                recipe_.velocity.z() = -draw(random_, ranges_.floor.fall_speed) * strength_ * scales_.speed;
                break;
            case RecipeKind::grips:
                add_hands();
                break;
            case RecipeKind::thrown:
                if (random_.unit() < ranges_.floor.under_thrown) add_floor();
                add_thrown();
                break;
            case RecipeKind::fold:
                add_fold();
                break;
            case RecipeKind::squash:
                add_plates();
                break;
            case RecipeKind::curl:
                add_curl();
                break;
            case RecipeKind::forces:
            case RecipeKind::free:
                break;
        }
        add_forces(kind.forces);
        return recipe_;
    }

 private:
    /// Adds stretch, shear and spin at once.
    void add_gradient(const Range& strain) {
        const double rate = draw(random_, strain) * strength_ * std::numbers::pi / scales_.time;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) recipe_.gradient(i, j) = random_.uniform(-1, 1);
        recipe_.gradient *= rate / recipe_.gradient.norm() * std::numbers::sqrt3;
    }

    void add_floor() {
        recipe_.floor = x_.col(2).minCoeff() - draw(random_, ranges_.floor.gap) * scales_.length;
        const double sag = draw(random_, ranges_.floor.sag) * strength_;
        recipe_.gravity.z() = -sag * scales_.speed * scales_.speed / scales_.length;
    }

    /// Adds pulls and pokes, some of them balanced by the opposite force elsewhere. share: relative number of
    /// forces.
    void add_forces(double share) {
        const int most =
            static_cast<int>(std::lround(share * std::max(2.0, duration_ / (2.5 * scales_.time))));
        for (int i = 0; i < most; ++i) {
            stop_if_asked();
            const double start = random_.uniform(-0.5, 0.9) * duration_,
                         length = draw(random_, ranges_.force.duration) * scales_.time;
            PatchForce force = patch(std::max(0.0, start), length);
            recipe_.forces.push_back(force);
            if (random_.unit() >= ranges_.force.balanced) continue;
            PatchForce other = patch(force.start, length);
            const double size = std::min(force.force.norm(), other.force.norm());
            recipe_.forces.back().force = size * force.force.stableNormalized();
            other.force = -recipe_.forces.back().force;
            recipe_.forces.push_back(other);
        }
    }

    /// Force = strain * modulus * cross-section of the patch's volume, so that a limb gets less than a trunk.
    /// It is reduced further where the patch is thin, because thin parts bend.
    PatchForce patch(double start, double duration) {
        PatchForce force{.node = random_.index(x_.rows()), .start = start, .duration = duration};
        force.radius = draw(random_, ranges_.force.radius) * scales_.length;
        const Eigen::Vector3d centre = body_.tets.X.row(force.node);
        const double area = thickness_.volume(centre, force.radius) / (2 * force.radius);
        const double slender = std::min(1.0, thickness_.at(centre, force.radius) / (stocky * scales_.length));
        // On a body held by two hands, forces pass through its limbs.
        const double held = recipe_.grips.empty() ? 1 : scales_.sturdiness * scales_.sturdiness;
        const double strain = draw(random_, ranges_.force.strain) * ranges_.strength * slender * held;
        force.force = strain * scales_.young * area * random_.direction();
        return force;
    }

    /// A random direction in which the body is long: the longest of a few random chords.
    Eigen::Vector3d long_axis() {
        Eigen::Vector3d longest = Eigen::Vector3d::Zero();
        for (int i = 0; i < 8; ++i) {
            const int a = random_.index(x_.rows()), b = random_.index(x_.rows());
            const Eigen::Vector3d chord = x_.row(a) - x_.row(b);
            if (chord.norm() > longest.norm()) longest = chord;
        }
        return longest.norm() > 0 ? longest.normalized() : random_.direction();
    }

    /// Holds the share of the body that lies nearest to its end along an axis. along: [N] positions of the
    /// nodes on it; end: -1 or 1.
    Hand hand(const Eigen::VectorXd& along, double end, double share) const {
        Hand grip;
        const double low = along.minCoeff(), span = along.maxCoeff() - low;
        for (int i = 0; i < x_.rows(); ++i) {
            const double from_end = (end < 0 ? along[i] - low : low + span - along[i]) / span;
            if (from_end <= share) grip.nodes.push_back(i);
        }
        const Nodes held = x_(grip.nodes, Eigen::all);
        grip.move.centre = held.colwise().mean().transpose();
        return grip;
    }

    /// By which angle the material around a point may be bent over a length, radians. x: at the start.
    double most_bend(const Eigen::Vector3d& x, double length) const {
        const Eigen::Vector3d at_rest =
            recipe_.rotation.transpose() * x + body_.tets.X.colwise().mean().transpose();
        const double thickness = thickness_.at(at_rest, 0.15 * scales_.length);
        return thickness > 0 ? most_bend_strain * length / thickness : std::numbers::pi;
    }

    /// Turns both halves of the body about its middle, so that its ends meet.
    void add_fold() {
        const RecipeRanges::Fold& ranges = ranges_.fold;
        const Eigen::Vector3d axis = long_axis();
        const Eigen::Vector3d across = random_perpendicular(random_, axis);
        const Eigen::VectorXd along = x_ * axis;
        const double middle = (along.minCoeff() + along.maxCoeff()) / 2, share = draw(random_, ranges.share);
        const double span = along.maxCoeff() - along.minCoeff();
        double angle = std::min(draw(random_, ranges.angle) * ranges_.strength, std::numbers::pi / 2);
        angle = std::min(angle, most_bend(Eigen::Vector3d::Zero(), span * (1 - 2 * share)));
        const double length = draw(random_, ranges.duration) * scales_.time;
        for (const double end : {-1.0, 1.0}) {
            Hand grip = hand(along, end, share);
            grip.move.duration = length;
            grip.release = 2 * duration_;
            grip.move.rotation = end * angle * axis.cross(across);
            const double arm = std::abs(grip.move.centre.dot(axis) - middle);
            grip.move.translation = arm * (end * (std::cos(angle) - 1) * axis + std::sin(angle) * across);
            recipe_.grips.push_back(grip);
        }
    }

    /// Two plates press the body flat and stay.
    void add_plates() {
        const double gap = draw(random_, ranges_.floor.gap) * scales_.length,
                     low = x_.col(2).minCoeff() - gap, high = x_.col(2).maxCoeff() + gap;
        const double share = std::min(draw(random_, ranges_.squash.share) * ranges_.strength, 0.95),
                     length = draw(random_, ranges_.squash.duration) * scales_.time;
        const double speed = (2 * gap + share * (high - low - 2 * gap)) / 2 / length;
        recipe_.plates.push_back({{0, 0, low}, Eigen::Vector3d::UnitZ(), speed, length});
        recipe_.plates.push_back({{0, 0, high}, -Eigen::Vector3d::UnitZ(), speed, length});
    }

    /// Draws tips towards the middle, so far that they stay apart. Tips are nodes far from the middle and
    /// from each other.
    void add_curl() {
        const RecipeRanges::Curl& ranges = ranges_.curl;
        const auto wanted = std::lround(draw(random_, ranges.tips));
        const double radius = draw(random_, ranges.radius) * scales_.length,
                     length = draw(random_, ranges.duration) * scales_.time;
        double close = draw(random_, ranges.close) * std::min(ranges_.strength, 1.0);
        std::vector<int> tips;
        Eigen::VectorXd apart = x_.rowwise().norm();  // from the middle and from the tips
        for (Eigen::Index tip = 0; std::ssize(tips) < wanted; tips.push_back(tip)) {
            const double distance = apart.maxCoeff(&tip);
            if (distance < 3 * radius) break;
            // A limb that bends by an angle brings its tip nearer by about a sixth of the angle's square.
            const double bend = most_bend(x_.row(tip), x_.row(tip).norm());
            close = std::min(close, bend * bend / 6);
            if (!tips.empty()) close = std::min(close, 1 - 2.5 * radius / distance);
            apart = apart.cwiseMin((x_.rowwise() - x_.row(tip)).rowwise().norm());
        }
        for (const int tip : tips) {
            Hand grip{
                .move = {.centre = x_.row(tip), .translation = -close * x_.row(tip), .duration = length},
                .release = 2 * duration_};
            for (int i = 0; i < x_.rows(); ++i)
                if ((x_.row(i) - x_.row(tip)).norm() <= radius) grip.nodes.push_back(i);
            recipe_.grips.push_back(grip);
        }
    }

    void add_hands() {
        const RecipeRanges::Hands& ranges = ranges_.hands;
        const Eigen::Vector3d axis = long_axis();
        const Eigen::VectorXd along = x_ * axis;
        const double span = along.maxCoeff() - along.minCoeff(), share = draw(random_, ranges.share);
        const double twist = draw(random_, ranges.twist), bend = draw(random_, ranges.bend);
        const double stretch = draw(random_, ranges.stretch), shear = draw(random_, ranges.shear);
        const Eigen::Vector3d across = random_perpendicular(random_, axis);
        const double start = draw(random_, ranges.start) * duration_,
                     length = draw(random_, ranges.duration) * scales_.time;
        const double release = draw(random_, ranges.release) * duration_;
        for (const double end : {-1.0, 1.0}) {
            Hand grip = hand(along, end, share);
            grip.move.start = start;
            grip.move.duration = length;
            grip.release = release;
            grip.move.rotation = end * strength_ * (twist * axis + bend * across);
            grip.move.translation = end * strength_ * span * (stretch * axis + shear * across) / 2;
            recipe_.grips.push_back(grip);
        }
    }

    /// Adds a copy thrown from beside, or from above if there is a floor. It starts where the extents of both
    /// bodies along its path just clear each other.
    void add_thrown() {
        ThrownCopy copy;
        copy.rotation = random_.orientation().toRotationMatrix();
        Eigen::Vector3d from = random_.direction();
        if (recipe_.floor) from = (from + 2 * Eigen::Vector3d::UnitZ()).normalized();
        const Nodes other = x_ * recipe_.rotation * copy.rotation.transpose();
        const double clearance = (x_ * from).maxCoeff() - (other * from).minCoeff() + 0.03 * scales_.length;
        const Eigen::Vector3d aside =
            draw(random_, ranges_.thrown.aside) * scales_.length * random_perpendicular(random_, from);
        copy.centre = clearance * from + aside;
        copy.velocity = -draw(random_, ranges_.thrown.speed) * strength_ * scales_.speed * from;
        if (recipe_.floor)  // never start below the floor
            copy.centre.z() =
                std::max(copy.centre.z(), *recipe_.floor - other.col(2).minCoeff() + 0.02 * scales_.length);
        recipe_.thrown = copy;
    }

    const Body& body_;
    const LocalThickness& thickness_;
    const NaturalScales& scales_;
    const RecipeRanges& ranges_;
    double strength_;  // strength of motions of the whole body
    CounterRandom random_;
    Recipe recipe_;
    double duration_ = 0;  // seconds, including all frames
    Nodes x_;              // nodes at the start
};

}  // namespace

RecipeBook::RecipeBook(std::shared_ptr<const Body> body, const ExcitationConfig& config)
    : body_(std::move(body)),
      config_(config),
      thickness_(body_->tets),
      scales_(natural_scales(*body_, thickness_)) {
    check_excitation_config(config);
    check_duration(config_, scales_);
}

double RecipeBook::frame_interval() const noexcept {
    return config_.frame_interval > 0 ? config_.frame_interval : scales_.time / 5;
}

Recipe RecipeBook::draw(int index) const {
    if (index < 0) throw std::invalid_argument(fmt::format("excitation: trajectory {} must be >= 0", index));
    return Draw(*body_, thickness_, scales_, config_, frame_interval(), index).run();
}

}  // namespace nbd
