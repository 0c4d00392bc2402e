#include "training/networks/radius_network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/bounds/learned/learned_model.hpp"
#include "training/networks/adam.hpp"
#include "training/networks/dense_kernel.hpp"
#include "training/networks/shuffle.hpp"

namespace nbd {

namespace {

using dense_kernel::Adjacent;
using dense_kernel::multiply;

/// Offsets of the parts in the flat weights of a network of width H with `inputs` samples.
template <int H>
struct Shape {
    int inputs;
    int b1() const noexcept { return H * inputs; }
    int W2() const noexcept { return b1() + H; }
    int b2() const noexcept { return W2() + H * H; }
    int w3() const noexcept { return b2() + H; }
    int b3() const noexcept { return w3() + H; }
    int weights() const noexcept { return b3() + 1; }
};

/// Shift and scale to mean 0 and standard deviation 1; constant numbers become 0.
struct Scaling {
    float mean = 0, factor = 0;

    explicit Scaling(const Eigen::VectorXf& x) {
        mean = static_cast<float>(x.cast<double>().mean());
        const double deviation =
            std::sqrt((x.cast<double>().array() - static_cast<double>(mean)).square().mean());
        // A smaller deviation is only rounding of the mean.
        if (deviation > 1e-6 * std::abs(static_cast<double>(mean)))
            factor = static_cast<float>(1 / deviation);
    }
};

/// Forward and backward pass of one batch.
template <int H>
class Batch {
 public:
    Batch(Shape<H> shape, int capacity)
        : shape_(shape),
          x_(capacity * shape.inputs),
          target_(capacity),
          h1_(capacity * H),
          h2_(h1_),
          d1_(h1_),
          d2_(h1_),
          d3_(capacity),
          rows_(H * H) {}

    /// Copies rows of scaled inputs and targets.
    void gather(const PoseRows& inputs, const Eigen::VectorXf& targets, const int* poses, int count) {
        count_ = count;
        for (int p = 0; p < count; ++p) {
            x_.segment(p * shape_.inputs, shape_.inputs) = inputs.row(poses[p]).transpose();
            target_[p] = targets[poses[p]];
        }
    }

    /// Mean loss of the batch and its gradient.
    float loss_and_gradient(const Eigen::VectorXf& w, double quantile, Eigen::VectorXf& g) {
        forward(w);
        const auto q = static_cast<float>(quantile);
        const auto n = static_cast<float>(count_);
        float loss = 0;
        for (int p = 0; p < count_; ++p) {
            const float error = d3_[p] - target_[p];
            if (quantile == 0) {
                loss += error * error;
                d3_[p] = 2 * error / n;
            } else {
                loss += error < 0 ? -q * error : (1 - q) * error;
                d3_[p] = (error < 0 ? -q : 1 - q) / n;
            }
        }
        backward(w, g);
        return loss / n;
    }

 private:
    /// Leaves the outputs in d3_.
    void forward(const Eigen::VectorXf& w) {
        const int n = count_ * H;
        multiply<H, Adjacent::k>(w.data(), shape_.inputs, x_.data(), shape_.inputs, count_,
                                 w.data() + shape_.b1(), h1_.data());
        h1_.head(n) = h1_.head(n).cwiseMax(0);
        multiply<H, Adjacent::k>(w.data() + shape_.W2(), H, h1_.data(), H, count_, w.data() + shape_.b2(),
                                 h2_.data());
        h2_.head(n) = h2_.head(n).cwiseMax(0);
        const auto w3 = w.segment<H>(shape_.w3());
        for (int p = 0; p < count_; ++p) d3_[p] = w3.dot(h2_.segment<H>(p * H)) + w[shape_.b3()];
    }

    void backward(const Eigen::VectorXf& w, Eigen::VectorXf& g) {
        using Layer = Eigen::Map<Eigen::Array<float, H, Eigen::Dynamic>>;
        const Eigen::Index n = count_;
        Layer h1(h1_.data(), H, n), h2(h2_.data(), H, n), d1(d1_.data(), H, n), d2(d2_.data(), H, n);
        g[shape_.b3()] = d3_.head(n).sum();
        g.segment<H>(shape_.w3()).noalias() = h2.matrix() * d3_.head(n);
        // ReLU passes no gradient back through a neuron with output 0.
        d2 = (w.segment<H>(shape_.w3()) * d3_.head(n).transpose()).array() * (h2 > 0).template cast<float>();
        multiply<H, Adjacent::n>(d2_.data(), count_, h1_.data(), H, H, nullptr, g.data() + shape_.W2());
        g.segment<H>(shape_.b2()) = d2.rowwise().sum();
        Eigen::Map<Eigen::Matrix<float, H, H>>(rows_.data()) =
            Eigen::Map<const Eigen::Matrix<float, H, H>>(w.data() + shape_.W2()).transpose();
        multiply<H, Adjacent::k>(rows_.data(), H, d2_.data(), H, count_, nullptr, d1_.data());
        d1 *= (h1 > 0).template cast<float>();
        multiply<H, Adjacent::n>(d1_.data(), count_, x_.data(), shape_.inputs, shape_.inputs, nullptr,
                                 g.data());
        g.segment<H>(shape_.b1()) = d1.rowwise().sum();
    }

    Shape<H> shape_;
    int count_ = 0;
    Eigen::VectorXf x_, target_, h1_, h2_, d1_, d2_, d3_, rows_;
};

template <int H>
Eigen::VectorXf initial_network(Shape<H> shape, std::uint64_t seed, std::uint64_t stream) {
    Eigen::VectorXf w = Eigen::VectorXf::Zero(shape.weights());
    const auto draw = [&](int begin, int end, double width) {
        for (int i = begin; i < end; ++i)
            w[i] = static_cast<float>(width *
                                      (2 * counter_uniform(seed, stream, static_cast<std::uint64_t>(i)) - 1));
    };
    draw(0, shape.b1(), std::sqrt(6.0 / shape.inputs));
    draw(shape.W2(), shape.b2(), std::sqrt(6.0 / H));
    draw(shape.w3(), shape.b3(), std::sqrt(3.0 / H));
    return w;
}

/// Folds the scalings of inputs and output into the weights.
template <int H>
void unscale(Shape<H> shape, const std::vector<Scaling>& inputs, const Scaling& output, Eigen::VectorXf& w) {
    for (int i = 0; i < shape.inputs; ++i) {
        const Scaling& s = inputs[static_cast<std::size_t>(i)];
        w.segment<H>(H * i) *= s.factor;
        w.segment<H>(shape.b1()) -= s.mean * w.segment<H>(H * i);
    }
    const float width = output.factor > 0 ? 1 / output.factor : 0;
    w.segment<H>(shape.w3()) *= width;
    w[shape.b3()] = w[shape.b3()] * width + output.mean;
}

template <int H>
TrainedRadiusNetwork train_network(const PoseRows& distances, const Eigen::VectorXf& growth,
                                   const RadiusNetworkConfig& config, std::uint64_t stream) {
    const Shape<H> shape{static_cast<int>(distances.cols())};
    const int poses = static_cast<int>(distances.rows());
    PoseRows inputs(poses, shape.inputs);
    std::vector<Scaling> scalings;
    for (int i = 0; i < shape.inputs; ++i) {
        const Scaling& s = scalings.emplace_back(distances.col(i));
        inputs.col(i) = (distances.col(i).array() - s.mean) * s.factor;
    }
    const Scaling output(growth);
    const Eigen::VectorXf targets = (growth.array() - output.mean) * output.factor;

    TrainedRadiusNetwork result{.weights = initial_network(shape, config.seed, stream)};
    if (output.factor == 0) result.weights.setZero();  // only the mean to learn
    Adam adam(shape.weights(), 0);
    Batch<H> batch(shape, std::min(config.batch, poses));
    Eigen::VectorXf gradient(shape.weights());
    std::vector<int> order(static_cast<std::size_t>(poses));
    std::iota(order.begin(), order.end(), 0);
    const int epochs = output.factor == 0 ? 0 : config.epochs;
    for (int epoch = 0; epoch < epochs; ++epoch) {
        shuffle(order, config.seed, stream, epoch);
        const double rate = config.learning_rate * (0.5 + 0.5 * std::cos(std::numbers::pi * epoch / epochs));
        double sum = 0;
        for (int begin = 0; begin < poses; begin += config.batch) {
            const int count = std::min(config.batch, poses - begin);
            batch.gather(inputs, targets, order.data() + begin, count);
            sum += static_cast<double>(batch.loss_and_gradient(result.weights, config.quantile, gradient)) *
                   count;
            adam.step(gradient, rate, result.weights);
        }
        result.loss = static_cast<float>(sum / poses);
    }
    unscale(shape, scalings, output, result.weights);
    return result;
}

template <int H>
Eigen::VectorXf apply_network(const Eigen::VectorXf& w, const PoseRows& distances) {
    const Shape<H> shape{static_cast<int>(distances.cols())};
    const Eigen::Map<const Eigen::MatrixXf> W1(w.data(), H, shape.inputs), W2(w.data() + shape.W2(), H, H);
    const Eigen::MatrixXf h1 =
        ((W1 * distances.transpose()).colwise() + w.segment<H>(shape.b1())).cwiseMax(0);
    const Eigen::MatrixXf h2 = ((W2 * h1).colwise() + w.segment<H>(shape.b2())).cwiseMax(0);
    return (h2.transpose() * w.segment<H>(shape.w3())).array() + w[shape.b3()];
}

}  // namespace

void check_network_config(const RadiusNetworkConfig& c) {
    const auto require = [](bool ok, const char* what, auto value, const char* allowed) {
        if (!ok) throw std::invalid_argument(fmt::format("{} {}; allowed: {}", what, value, allowed));
    };
    require(c.epochs >= 1, "epochs of a radius network:", c.epochs, "1 or more");
    require(c.batch >= 1, "batch of a radius network:", c.batch, "1 or more");
    require(c.learning_rate > 0 && c.learning_rate <= 1, "learning rate of a radius network", c.learning_rate,
            "(0, 1]");
    require(c.hidden == 16 || c.hidden == 32, "width of a radius network:", c.hidden, "16 or 32");
    require(c.quantile >= 0 && c.quantile < 1, "quantile of a radius network", c.quantile, "[0, 1)");
}

TrainedRadiusNetwork train_radius_network(const PoseRows& distances, const Eigen::VectorXf& growth,
                                          const RadiusNetworkConfig& config, std::uint64_t stream) {
    return config.hidden == 32 ? train_network<32>(distances, growth, config, stream)
                               : train_network<16>(distances, growth, config, stream);
}

Eigen::VectorXf apply_radius_network(const Eigen::VectorXf& w, const PoseRows& distances) {
    const bool wide = w.size() == Shape<32>{static_cast<int>(distances.cols())}.weights();
    return wide ? apply_network<32>(w, distances) : apply_network<16>(w, distances);
}

}  // namespace nbd
