#include "collision/continuous/feature_query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

/// The boxes of both features of a pair, in double precision.
class PairBoxes {
 public:
    explicit PairBoxes(FeatureKind kind) : of_a_(corners_of_a(kind)) {}

    /// corner: 0 .. 3, in the order of closest_points().
    void add(std::size_t corner, const Eigen::Array3d& p) {
        Box& box = corner < of_a_ ? a_ : b_;
        box.low = box.low.min(p);
        box.high = box.high.max(p);
    }

    /// The gap between the boxes along each axis; negative where they overlap.
    Eigen::Array3d gaps() const { return (a_.low - b_.high).max(b_.low - a_.high); }

 private:
    struct Box {
        Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    };
    std::size_t of_a_;
    Box a_, b_;
};

void require_positions(const char* name, NodesRef x, Eigen::Index vertices) {
    if (x.rows() != vertices)
        throw std::invalid_argument(
            message(name, " has ", x.rows(), " positions, but the surface has ", vertices, " vertices"));
    for (Eigen::Index v = 0; v < x.rows(); ++v)
        if (!x.row(v).allFinite())
            throw std::invalid_argument(message(name, ": position of vertex ", v, " is not finite"));
}

std::shared_ptr<const CollisionTree> tree_of(NodesRef X, FacesRef F) {
    if (F.rows() == 0) throw std::invalid_argument("the surface has no faces");
    require_positions("X", X, X.rows());
    const Eigen::RowVector3d low = X.colwise().minCoeff(), high = X.colwise().maxCoeff();
    const double size = (high / 2 - low / 2).maxCoeff();
    const Eigen::RowVector3d centre = low / 2 + high / 2;
    const Nodes about = X.rowwise() - centre;
    return shared_exact_tree((size > 0 ? Nodes(about / size) : about).cast<float>(), F);
}

constexpr double epsilon = std::numeric_limits<double>::epsilon();

void require_distance(const char* name, double distance) {
    if (!(distance >= 0 && std::isfinite(distance)))
        throw std::invalid_argument(message(name, " is ", distance, ", allowed: finite, 0 or more"));
}

/// An origin in the middle of positions and a power of two that scales them to at most 1.
struct Frame {
    Eigen::RowVector3d low = Eigen::RowVector3d::Constant(std::numeric_limits<double>::infinity()),
                       high = -low;

    void add(const MovingBody& body) {
        for (const Nodes* x : {&body.begin(), &body.end()}) {
            low = low.cwiseMin(x->colwise().minCoeff());
            high = high.cwiseMax(x->colwise().maxCoeff());
        }
    }
    Eigen::RowVector3d origin() const { return low / 2 + high / 2; }
    double scale() const {
        constexpr int most = 1000;  // of the exponent; smaller surfaces stay small
        int exponent = 0;
        std::frexp((high / 2 - low / 2).maxCoeff(), &exponent);
        return std::ldexp(1, std::clamp(-exponent, -most - 24, most));
    }
};

/// The distance for a query of float boxes that finds all double boxes within `distance` of each other.
float query_distance(double distance, double rounding_a, double rounding_b) {
    constexpr double everything = 16, room = 2;  // `room` is above the square root of three axes
    const double most = std::min(distance, everything) + room * (rounding_a + rounding_b);
    return std::nextafter(static_cast<float>(most), std::numeric_limits<float>::infinity());
}

}  // namespace

MovingBody::MovingBody(NodesRef X, FacesRef F, BodyRole role)
    : role_(role),
      F_(F),
      features_(surface_features(F, X.rows())),
      begin_(X),
      end_(X),
      tree_(tree_of(X, F), BoundKind::boxes),
      own_tree_(refer_to(tree_.tree()), BoundKind::boxes) {
    if (!is_obstacle()) neighbours_ = neighbour_features(F_, features_, 0);
}

void MovingBody::move(NodesRef begin, NodesRef end) {
    require_positions("begin", begin, begin_.rows());
    require_positions("end", end, begin_.rows());
    begin_ = begin;
    end_ = end;
}

void MovingBody::make_local(Local& local, const Eigen::RowVector3d& origin, double scale,
                            bool with_motion) const {
    local.begin = (begin_.rowwise() - origin) * scale;
    local.end = (end_.rowwise() - origin) * scale;
    if (with_motion) {
        const Eigen::RowVector3d motion = (local.end - local.begin).colwise().mean();
        local.end.rowwise() -= motion;
    }
    local.begin_float = local.begin.cast<float>();
    local.end_float = local.end.cast<float>();
    local.rounding =
        0x1p-24 * std::max(local.begin.cwiseAbs().maxCoeff(), local.end.cwiseAbs().maxCoeff()) + 0x1p-149;
}

/// The pairs that the query of the faces left out are those of `neighbours_`; both are narrowed here.
void FeatureQuery::find(std::span<MovingBody> bodies, int body, double distance) {
    MovingBody& b = bodies[body];
    Frame frame;
    frame.add(b);
    const double scale = frame.scale();
    b.make_local(b.own_, frame.origin(), scale, true);
    b.own_tree_.begin_step(b.own_.begin_float, b.own_.end_float);
    const double most = distance * scale;
    const NumberedSurface surface = b.numbered(body);
    const std::size_t before = pairs_.size();
    for (FeaturePair pair : b.neighbours_) {
        pair.surface_a = pair.surface_b = body;
        pairs_.push_back(pair);
    }
    for (const FacePair& faces :
         self_query_.boxes_within(b.own_tree_, query_distance(most, b.own_.rounding, b.own_.rounding)))
        for_each_owned_pair(surface, surface, faces,
                            [&](const FeaturePair& pair, auto) { pairs_.push_back(pair); });
    keep_near(before, b, b.own_, b, b.own_, most);
}

void FeatureQuery::find(std::span<MovingBody> bodies, int a, int b, double distance) {
    MovingBody &s = bodies[a], &t = bodies[b];
    const NumberedSurface of_s = s.numbered(a), of_t = t.numbered(b);
    const std::size_t before = pairs_.size();
    for (const FacePair& faces : pair_query_.boxes_within(
             s.tree_, t.tree_, query_distance(distance, s.local_.rounding, t.local_.rounding)))
        for_each_owned_pair(of_s, of_t, faces,
                            [&](const FeaturePair& pair, auto) { pairs_.push_back(pair); });
    keep_near(before, s, s.local_, t, t.local_, distance);
}

/// Of the pairs from `first` on, keeps those whose boxes over the step are near. s, t: bodies of the smaller
/// and of the larger number.
void FeatureQuery::keep_near(std::size_t first, const MovingBody& s, const MovingBody::Local& local_s,
                             const MovingBody& t, const MovingBody::Local& local_t, double distance) {
    const double most = distance * (1 + 8 * epsilon) + 8 * epsilon;
    const auto is_far = [&](const FeaturePair& pair) {
        const bool swapped = pair.surface_a > pair.surface_b;
        const MovingBody &a = swapped ? t : s, &b = swapped ? s : t;
        const MovingBody::Local &in_a = swapped ? local_t : local_s, &in_b = swapped ? local_s : local_t;
        const auto at = feature_vertices(pair, a, b);
        PairBoxes over_step(pair.kind);
        for (std::size_t k = 0; k < 4; ++k) {
            const MovingBody::Local& in = k < corners_of_a(pair.kind) ? in_a : in_b;
            over_step.add(k, in.begin.row(at[k]).transpose().array());
            over_step.add(k, in.end.row(at[k]).transpose().array());
        }
        return over_step.gaps().max(0).square().sum() > most * most;
    };
    pairs_.erase(std::remove_if(pairs_.begin() + static_cast<std::ptrdiff_t>(first), pairs_.end(), is_far),
                 pairs_.end());
}

std::span<const FeaturePair> FeatureQuery::candidates(std::span<MovingBody> bodies, double distance) {
    require_distance("distance", distance);
    pairs_.clear();
    const int count = bodies.size();
    if (count > 1) {
        Frame frame;
        for (const MovingBody& body : bodies) frame.add(body);
        const double scale = frame.scale();
        for (MovingBody& body : bodies) {
            body.make_local(body.local_, frame.origin(), scale, false);
            body.tree_.begin_step(body.local_.begin_float, body.local_.end_float);
        }
        for (int a = 0; a < count; ++a)
            for (int b = a + 1; b < count; ++b)
                if (!bodies[a].is_obstacle() || !bodies[b].is_obstacle())
                    find(bodies, a, b, distance * scale);
    }
    for (int b = 0; b < count; ++b)
        if (!bodies[b].is_obstacle()) find(bodies, b, distance);
    std::ranges::sort(pairs_);
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()),
                 pairs_.end());  // of faces that name a vertex twice
    return pairs_;
}

FreeStep FeatureQuery::collision_free_step(std::span<MovingBody> bodies, double separation, double left) {
    constexpr double tolerance_share = 0.05;  // of the room left, by which an impact may be found too early
    require_distance("separation", separation);
    if (!(left >= 0 && left < 1))
        throw std::invalid_argument(message("left is ", left, ", allowed: 0 or more, below 1"));
    FreeStep step;
    for (const FeaturePair& pair : candidates(bodies, separation)) {
        const MovingBody &a = bodies[pair.surface_a], &b = bodies[pair.surface_b];
        const auto at = feature_vertices(pair, a, b);
        std::array<MovingPoint, 4> x;
        std::array<Eigen::Vector3d, 4> begin;
        for (std::size_t k = 0; k < 4; ++k) {
            const MovingBody& body = k < corners_of_a(pair.kind) ? a : b;
            x[k] = {body.begin().row(at[k]), body.end().row(at[k])};
            begin[k] = x[k].begin;
        }
        const Impact impact = feature_impact(pair.kind, x, {.separation = separation});
        if (!impact.hits) continue;
        const double gap = closest_points(pair.kind, begin).distance;
        const double room = left * std::max(gap - separation, 0.0);
        const Impact earlier = feature_impact(
            pair.kind, x, {.separation = separation + room, .tolerance = tolerance_share * room});
        const double share = std::min(impact.time, earlier.time);
        if (!step.limit || share < step.share)
            step = {.share = share,
                    .limit = pair,
                    .gap = gap,
                    .exhausted = impact.exhausted || earlier.exhausted};
    }
    return step;
}

}  // namespace nbd
