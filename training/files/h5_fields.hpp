#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "collision/tree/tree_fields.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"

// The fields of tree_fields.hpp and others in an HDF5 file: arrays are datasets, single numbers and texts are
// attributes of their groups.
namespace nbd {

/// Name of a field's dataset.
inline std::string h5_dataset(const std::string& field) {
    return field.ends_with("/modes/w") ? field.substr(0, field.size() - 1) + "weights" : field;
}

/// Group and name of a field's attribute.
inline std::pair<std::string, std::string> h5_attribute(const std::string& field) {
    const std::size_t slash = field.rfind('/');
    return {field.substr(0, slash), field.substr(slash + 1)};
}

inline h5::Shape h5_shape(Eigen::Index rows, Eigen::Index columns) {
    const std::size_t count = rows;
    return columns == 1 ? h5::Shape{count} : h5::Shape{count, static_cast<std::size_t>(columns)};
}

/// The numbers of a struct's member: one, or those of a vector.
template <class T>
auto numbers_of(T& member) {
    if constexpr (std::is_arithmetic_v<std::remove_const_t<T>>)
        return std::span(&member, 1);
    else
        return std::span(member.data(), member.size());
}
template <class T>
using NumberOf = typename decltype(numbers_of(std::declval<T&>()))::value_type;

template <class Struct, class... T>
std::size_t numbers_of_row(const TableColumn<Struct, T>&... columns) {
    const Struct row{};
    return (numbers_of(row.*columns.member).size() + ...);
}

class H5FieldWriter {
 public:
    /// Deflates everything: index arrays shrink to a third, float32 by a tenth.
    static constexpr auto packing = h5::Packing::deflate;

    explicit H5FieldWriter(h5::Writer& file) : file_(file) {}

    /// Makes a group a link to another one: its fields are left out.
    void link(const std::string& group, const std::string& target) {
        file_.link(group, target);
        linked_ = group + "/";
    }

    template <class T>
    requires std::is_arithmetic_v<T> || std::is_same_v<T, std::string>
    void field(const std::string& name, const T& value) {
        const auto [group, item] = h5_attribute(name);
        file_.group(group);
        file_.attribute(group, item, std::conditional_t<std::is_same_v<T, bool>, int, T>(value));
    }
    template <h5::Number T>
    void field(const std::string& name, const std::vector<T>& values, Eigen::Index,
               Eigen::Index columns = 1) {
        if (!is_linked(name))
            file_.write(h5_dataset(name), h5_shape(std::ssize(values) / columns, columns), std::span(values),
                        packing);
    }
    template <class M>
    void field(const std::string& name, const Eigen::PlainObjectBase<M>& matrix, Eigen::Index,
               Eigen::Index = 1) {
        if (!is_linked(name)) file_.write(h5_dataset(name), matrix, packing);
    }
    void field(const std::string& name, const FixedMatrix& matrix, Eigen::Index rows, Eigen::Index columns) {
        field(name, matrix.numbers(), rows, columns);
    }
    /// Of the surface, which the file has anyway.
    void follows(const std::string&, const auto&...) {}
    void may_be_empty(const std::string& name, const auto& value, Eigen::Index rows,
                      Eigen::Index columns = 1) {
        if (value.size() > 0) field(name, value, rows, columns);
    }
    void added_later(const std::string& name, const auto&... value) { field(name, value...); }
    /// Writes a text of any length as a dataset.
    void text(const std::string& name, const std::string& value) { file_.write_text(name, value); }
    /// Writes one dataset with a row of numbers for each struct.
    template <class Struct, class First, class... T>
    void table(const std::string& name, const std::vector<Struct>& rows, Eigen::Index,
               TableColumn<Struct, First> first, TableColumn<Struct, T>... others) {
        static_assert(is_whole_struct<Struct, First, T...>, "a member of the struct has no column");
        std::vector<NumberOf<First>> numbers;
        const auto add = [&](const auto& member) {
            for (const auto number : numbers_of(member)) numbers.push_back(number);
        };
        for (const Struct& row : rows) add(row.*first.member), (add(row.*others.member), ...);
        file_.write(name, {rows.size(), numbers_of_row(first, others...)}, std::span(std::as_const(numbers)),
                    packing);
    }
    void numbers(const std::string& name, NetworkNumbers value) {
        field(name, std::string(nbd::name(value)));
    }
    template <class T, class Fields>
    void optional(const std::string&, const std::optional<T>& value, const Fields& fields) {
        if (value) fields(*this, *value);
    }
    template <class Map, class Fields>
    void entry(const std::string&, const Map& map, const typename Map::key_type& key, const Fields& fields) {
        if (const auto found = map.find(key); found != map.end()) fields(*this, found->second);
    }

 private:
    bool is_linked(const std::string& name) const { return !linked_.empty() && name.starts_with(linked_); }

    h5::Writer& file_;
    std::string linked_;
};

/// Refuses what its Reader refuses, and numbers that a field cannot hold.
class H5FieldReader {
 public:
    explicit H5FieldReader(const h5::Reader& file) : file_(file) {}

    template <class T>
    requires std::is_arithmetic_v<T> || std::is_same_v<T, std::string>
    void field(const std::string& name, T& value) {
        const auto [group, item] = h5_attribute(name);
        value = file_.attribute<T>(group, item);
    }
    template <h5::Number T>
    void field(const std::string& name, std::vector<T>& values, Eigen::Index rows, Eigen::Index columns = 1) {
        values = file_.read<T>(h5_dataset(name), h5_shape(rows, columns));
    }
    template <class M>
    void field(const std::string& name, Eigen::PlainObjectBase<M>& matrix, Eigen::Index rows,
               Eigen::Index columns = 1) {
        matrix.derived() = file_.matrix<M>(h5_dataset(name), rows, columns);
    }
    void field(const std::string& name, FixedMatrix& matrix, Eigen::Index rows, Eigen::Index columns) {
        matrix = FixedMatrix(file_.matrix<Eigen::MatrixXf>(h5_dataset(name), rows, columns));
    }
    /// The caller sets these.
    void follows(const std::string&, const auto&...) {}
    void may_be_empty(const std::string& name, auto& value, Eigen::Index rows, Eigen::Index columns = 1) {
        if (file_.has(name)) field(name, value, rows, columns);
    }
    /// A field that older files lack.
    void added_later(const std::string& name, bool& value) {
        const auto [group, item] = h5_attribute(name);
        if (file_.has_attribute(group, item)) field(name, value);
    }
    void added_later(const std::string& name, auto& value, Eigen::Index rows) {
        may_be_empty(name, value, rows);
    }
    void text(const std::string& name, std::string& value) { value = file_.read_text(name); }
    template <class Struct, class First, class... T>
    void table(const std::string& name, std::vector<Struct>& rows, Eigen::Index count,
               TableColumn<Struct, First> first, TableColumn<Struct, T>... others) {
        const std::size_t width = numbers_of_row(first, others...);
        const auto numbers = file_.read<NumberOf<First>>(name, h5_shape(count, width));
        auto next = numbers.begin();
        const auto take = [&](auto& member) {
            for (auto& number : numbers_of(member)) number = *next++;
        };
        rows.resize(numbers.size() / width);
        for (Struct& row : rows) take(row.*first.member), (take(row.*others.member), ...);
    }
    /// Bytes in files that do not say.
    void numbers(const std::string& name, NetworkNumbers& value) {
        const auto [group, item] = h5_attribute(name);
        if (!file_.has_attribute(group, item)) return;
        const auto text = file_.attribute<std::string>(group, item);
        value = text == nbd::name(NetworkNumbers::floats) ? NetworkNumbers::floats : NetworkNumbers::bytes;
        if (text != nbd::name(value))
            file_.refuse(fmt::format("the networks have {} as numbers", text), "bytes and floats");
    }
    template <class T, class Fields>
    void optional(const std::string& group, std::optional<T>& value, const Fields& fields) {
        if (file_.has(group)) fields(*this, value.emplace());
    }
    template <class Map, class Fields>
    void entry(const std::string& group, Map& map, const typename Map::key_type& key, const Fields& fields) {
        if (file_.has(group)) fields(*this, map[key]);
    }

 private:
    const h5::Reader& file_;
};

}  // namespace nbd
