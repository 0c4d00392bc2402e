#include "training/files/reaction_arrays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <type_traits>

namespace nbd {
namespace {

constexpr std::size_t rows_at_once = 1024;

std::string array_name(const ReactionColumn& column) {
    return fmt::format("{}/{}", reactions_group, column.name);
}

/// What is wrong with a row that follows another one; "" if nothing is.
std::string row_defect(const RecordedReaction& row, const RecordedReaction& before) {
    if (row.frame < before.frame || row.time < before.time || row.frame < 0)
        return fmt::format("a reaction of frame {} at {} s after one of frame {} at {} s; allowed: in order",
                           row.frame, row.time, before.frame, before.time);
    if (row.body < 0) return fmt::format("a reaction on body {}; allowed: at least 0", row.body);
    if (!(row.force.allFinite() && row.torque.allFinite() && row.point.allFinite() &&
          std::isfinite(row.time) && std::isfinite(row.pressure) && std::isfinite(row.volume)))
        return fmt::format("a reaction of frame {} that is not finite; allowed: finite numbers", row.frame);
    return {};
}

}  // namespace

ReactionArrays::ReactionArrays(h5::Writer& file) : file_(file) {
    for (const ReactionColumn& column : reaction_columns) {
        const auto begin = [&](h5::Type type, const h5::Shape& row) {
            handles_.push_back(
                file.begin_growing(array_name(column), type, row, rows_at_once, h5::Packing::deflate));
        };
        std::visit(
            [&]<class T>(ReactionColumn::Member<T>) {
                if constexpr (std::is_same_v<T, double>)
                    begin(h5::Type::float64, {});
                else if constexpr (std::is_same_v<T, Eigen::Vector3d>)
                    begin(h5::Type::float64, {3});
                else
                    begin(h5::Type::int32, {});
            },
            column.value);
    }
}

/// A text is one line, whatever it holds.
int ReactionArrays::number_of(std::string text) {
    std::ranges::replace_if(
        text, [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
    const auto [known, is_new] = numbers_.try_emplace(text, std::ssize(names_));
    if (is_new) names_.push_back(text);
    return known->second;
}

void ReactionArrays::add(std::span<const RecordedReaction> rows) {
    for (const RecordedReaction& row : rows) {
        if (const std::string defect = row_defect(row, last_); !defect.empty())
            throw std::invalid_argument(fmt::format("{}: has {}", file_.path().string(), defect));
        last_ = row;
        // In the order of the rows, whatever parts they come in.
        number_of(row.kind);
        number_of(row.by);
    }
    if (rows.empty()) return;
    std::vector<double> numbers;
    std::vector<std::int32_t> whole;
    for (std::size_t c = 0; c < reaction_columns.size(); ++c) {
        numbers.clear();
        whole.clear();
        const auto take = [&]<class T>(ReactionColumn::Member<T> member) {
            for (const RecordedReaction& row : rows) {
                const T& value = row.*member;
                if constexpr (std::is_same_v<T, Eigen::Vector3d>)
                    numbers.insert(numbers.end(), value.begin(), value.end());
                else if constexpr (std::is_same_v<T, double>)
                    numbers.push_back(value);
                else if constexpr (std::is_same_v<T, std::string>)
                    whole.push_back(number_of(value));
                else
                    whole.push_back(value);
            }
        };
        std::visit(take, reaction_columns[c].value);
        if (!numbers.empty()) file_.append<double>(handles_[c], numbers);
        if (!whole.empty()) file_.append<std::int32_t>(handles_[c], whole);
    }
}

void ReactionArrays::finish() {
    for (const int handle : handles_) file_.end_growing(handle);
    file_.write_text(reaction_names, fmt::format("{}", fmt::join(names_, "\n")));
}

std::vector<RecordedReaction> read_reactions(const h5::Reader& file) {
    if (!file.has(reactions_group)) return {};
    std::vector<std::string> names{""};
    for (const char c : file.read_text(reaction_names))
        if (c == '\n')
            names.emplace_back();
        else
            names.back() += c;
    std::vector<RecordedReaction> rows;
    std::optional<std::size_t> count;
    const auto fill = [&](const auto& values, std::size_t width, const auto& put) {
        if (!count) rows.resize(*(count = values.size() / width));
        for (std::size_t i = 0; i < *count; ++i) put(rows[i], &values[i * width]);
    };
    for (const ReactionColumn& column : reaction_columns) {
        const std::string name = array_name(column);
        const std::size_t length = count.value_or(h5::any);
        std::visit(
            [&]<class T>(ReactionColumn::Member<T> member) {
                if constexpr (std::is_same_v<T, Eigen::Vector3d>)
                    fill(file.read<double>(name, {length, 3}), 3,
                         [&](RecordedReaction& row, const double* at) {
                             row.*member = Eigen::Vector3d(at[0], at[1], at[2]);
                         });
                else if constexpr (std::is_same_v<T, double>)
                    fill(file.read<double>(name, {length}), 1,
                         [&](RecordedReaction& row, const double* at) { row.*member = *at; });
                else if constexpr (std::is_same_v<T, int>)
                    fill(file.read<std::int32_t>(name, {length}), 1,
                         [&](RecordedReaction& row, const std::int32_t* at) { row.*member = *at; });
                else
                    fill(file.read<std::int32_t>(name, {length}), 1,
                         [&](RecordedReaction& row, const std::int32_t* at) {
                             if (*at < 0 || *at >= std::ssize(names))
                                 file.refuse(fmt::format("'{}' has text {}", name, *at),
                                             fmt::format("0 to {}", names.size() - 1));
                             row.*member = names[*at];
                         });
            },
            column.value);
    }
    RecordedReaction before;
    for (const RecordedReaction& row : rows) {
        if (const std::string defect = row_defect(row, before); !defect.empty())
            throw std::runtime_error(fmt::format("{}: has {}", file.path().string(), defect));
        before = row;
    }
    return rows;
}

}  // namespace nbd
