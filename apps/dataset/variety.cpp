#include "apps/dataset/variety.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {
namespace {

constexpr long max_samples = 1000;

// Bins of logarithms of stretches from -range to range, 0.1 % each.
constexpr double range = 5;
constexpr int bins = 10000;

int bin_of(double stretch) {
    const double u = (std::log(std::max(stretch, 1e-300)) + range) / (2 * range);
    return std::clamp(static_cast<int>(u * bins), 0, bins - 1);
}

double stretch_of(int bin) { return std::exp((bin + 0.5) / bins * 2 * range - range); }

std::string kind_of(const std::string& recipe) {
    const auto json = nlohmann::json::parse(recipe, nullptr, false);
    return json.is_object() && json.contains("kind") && json["kind"].is_string()
               ? json["kind"].get<std::string>()
               : "unknown";
}

Eigen::Matrix3d edges(const Nodes& x, const Tets& T, Eigen::Index t) {
    Eigen::Matrix3d result;
    for (int k = 0; k < 3; ++k) result.col(k) = (x.row(T(t, k + 1)) - x.row(T(t, 0))).transpose();
    return result;
}

}  // namespace

struct VarietyMeter::Sample {
    std::vector<std::int64_t> histogram;
    double least = 1, largest = 1, displacement = 0;
    Eigen::VectorXd modal;
};

VarietyMeter::VarietyMeter(const Body& body, long frames)
    : body_(body),
      stride_(std::max(1L, frames / max_samples)),
      masses_(Eigen::VectorXd::Zero(body.tets.X.rows())),
      histogram_(bins, 0),
      sum_(Eigen::VectorXd::Zero(body.modes.count())),
      squares_(sum_) {
    const Tets& T = body.tets.T;
    const auto materials = materials_of_tets(body.material, body.regions, T.rows());
    for (Eigen::Index t = 0; t < T.rows(); ++t) {
        const Eigen::Matrix3d E = edges(body.tets.X, T, t);
        inverses_.push_back(E.inverse());
        for (int k = 0; k < 4; ++k) masses_[T(t, k)] += materials[t]->density * E.determinant() / 24;
    }
    const Eigen::RowVector3d centre = masses_.transpose() * body.tets.X / masses_.sum();
    rest_ = body.tets.X.rowwise() - centre;
    counts_.body_length = (rest_.colwise().maxCoeff() - rest_.colwise().minCoeff()).norm();
    counts_.frequencies.assign(body.modes.frequencies.begin(), body.modes.frequencies.end());
}

void VarietyMeter::measure(const Eigen::Ref<const Vertices>& frame, Sample& sample) const {
    Nodes x = frame.cast<double>();
    x.rowwise() -= (masses_.transpose() * x / masses_.sum()).eval();
    sample.histogram.assign(bins, 0);
    for (Eigen::Index t = 0; t < body_.tets.T.rows(); ++t) {
        const Eigen::Matrix3d F = edges(x, body_.tets.T, t) * inverses_[t];
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
        solver.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
        const Eigen::Vector3d stretch = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
        for (const double s : stretch) ++sample.histogram[bin_of(s)];
        sample.least = std::min(sample.least, stretch.minCoeff());
        sample.largest = std::max(sample.largest, stretch.maxCoeff());
    }
    const Eigen::Matrix3d R = rotation_of(x.transpose() * masses_.asDiagonal() * rest_);
    const Nodes u = x * R - rest_;
    sample.displacement = (masses_.asDiagonal() * u).cwiseProduct(u).sum();
    const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> momentum =
        (masses_.asDiagonal() * u).cast<float>();
    const Eigen::Map<const Eigen::VectorXf> stacked(momentum.data(), momentum.size());
    sample.modal = (body_.modes.U.transpose() * stacked).cast<double>();
}

void VarietyMeter::take(const Sample& sample) {
    ++counts_.sampled;
    for (std::size_t i = 0; i < histogram_.size(); ++i) histogram_[i] += sample.histogram[i];
    counts_.least_stretch = std::min(counts_.least_stretch, sample.least);
    counts_.largest_stretch = std::max(counts_.largest_stretch, sample.largest);
    displacement_ += sample.displacement;
    sum_ += sample.modal;
    squares_ += sample.modal.cwiseAbs2();
}

void VarietyMeter::add(const RecordingReader& recording) {
    constexpr std::size_t frames_at_once = 16;
    const auto& infos = recording.trajectories();
    const Eigen::Index nodes = body_.tets.X.rows();
    for (int i = 0; i < std::ssize(infos); ++i) {
        const TrajectoryInfo& info = infos[i];
        KindVariety& kind = counts_.kinds[kind_of(info.recipe)];
        ++kind.trajectories;
        if (!info.failure.empty()) {
            ++kind.failed;
            continue;
        }
        const auto positive = [](const std::vector<std::int32_t>& counts) {
            return std::ranges::count_if(counts, [](int count) { return count > 0; });
        };
        const FrameFacts& facts = recording.facts(i);
        kind.frames += info.frames;
        kind.frames_in_contact += positive(facts.contacts);
        kind.frames_troubled += positive(facts.troubled);
        kind.frames_self_intersecting += positive(facts.self_intersections);

        std::vector<int> chosen;
        for (int frame = 0; frame < info.frames; ++frame)
            if (seen_++ % stride_ == 0) chosen.push_back(frame);
        for (std::size_t begin = 0; begin < chosen.size(); begin += frames_at_once) {
            const std::size_t count = std::min(frames_at_once, chosen.size() - begin);
            std::vector<Vertices> frames(count);
            std::vector<Sample> samples(count);
            for (std::size_t k = 0; k < count; ++k) recording.read(i, chosen[begin + k], 1, frames[k]);
            const auto measure_one = [&](int k) {
                const std::size_t slot = k;
                if (frames[slot].rows() == nodes) measure(frames[slot], samples[slot]);
            };
            parallel_for(count, measure_one, 1);
            for (const Sample& sample : samples)
                if (!sample.histogram.empty()) take(sample);
        }
    }
}

KindVariety& KindVariety::operator+=(const KindVariety& other) {
    trajectories += other.trajectories;
    failed += other.failed;
    frames += other.frames;
    frames_in_contact += other.frames_in_contact;
    frames_troubled += other.frames_troubled;
    frames_self_intersecting += other.frames_self_intersecting;
    return *this;
}

Variety VarietyMeter::report() const {
    Variety variety = counts_;
    for (const auto& [name, kind] : variety.kinds) variety.all += kind;
    if (variety.sampled == 0) return variety;
    std::int64_t total = 0;
    for (const std::int64_t count : histogram_) total += count;
    for (const double quantile : variety_quantiles) {
        std::int64_t below = 0;
        int bin = 0;
        while (bin < bins - 1 && (below += histogram_[bin]) < quantile * static_cast<double>(total)) ++bin;
        variety.stretch.push_back(stretch_of(bin));
    }
    const double mass = masses_.sum(), n = variety.sampled;
    variety.displacement = std::sqrt(displacement_ / n / mass);
    double held = 0;
    for (Eigen::Index k = 0; k < sum_.size(); ++k) {
        const double mean = sum_[k] / n;
        variety.mode_std.push_back(std::sqrt(std::max(0., squares_[k] / n - mean * mean) / mass));
        held += squares_[k];
        variety.mode_share.push_back(displacement_ > 0 ? held / displacement_ : 0);
    }
    return variety;
}

}  // namespace nbd
