#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "collision/base/message.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/nbd_tree/fixed_point.hpp"
#include "collision/tree/tree_fields.hpp"

// The fields of tree_fields.hpp as arrays of a flat file.
namespace nbd {

/// The stored type of a number: bool as a byte, integers by their size.
template <class T>
using FlatStored =
    std::conditional_t<!std::is_integral_v<T>, T,
                       std::conditional_t<sizeof(T) == 1, std::uint8_t,
                                          std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>>>;

/// Matrix in the row-major order of the file.
template <class T>
using FlatRows = Eigen::Matrix<FlatStored<T>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <class M>
concept EigenMatrix = std::is_base_of_v<Eigen::PlainObjectBase<M>, M>;

class FlatFieldWriter {
 public:
    template <class T>
    requires std::is_arithmetic_v<T>
    void field(std::string_view name, const T& value) {
        const auto stored = static_cast<FlatStored<T>>(value);
        file_.add(name, 1, 1, &stored);
    }
    template <FlatNumber T>
    void field(std::string_view name, const std::vector<T>& values, Eigen::Index = 0, Eigen::Index = 1) {
        file_.add(name, values.size(), 1, values.data());
    }
    template <EigenMatrix M>
    void field(std::string_view name, const M& matrix, Eigen::Index = 0, Eigen::Index = 1) {
        const FlatRows<typename M::Scalar> rows = matrix;
        file_.add(name, rows.rows(), rows.cols(), rows.data());
    }
    void field(std::string_view name, const FixedMatrix& matrix, Eigen::Index = 0, Eigen::Index = 1) {
        field(name, matrix.numbers());
    }
    void may_be_empty(std::string_view name, const auto& value, Eigen::Index = 0, Eigen::Index = 1) {
        field(name, value);
    }
    void follows(const std::string& name, const auto& value, auto... shape) { field(name, value, shape...); }
    /// Writes one array per member.
    template <class Struct, class... T>
    void table(const std::string& name, const std::vector<Struct>& rows, Eigen::Index,
               TableColumn<Struct, T>... columns) {
        static_assert(is_whole_struct<Struct, T...>, "a member of the struct has no column");
        (column(name, rows, columns), ...);
    }
    /// Absent for networks in bytes.
    void numbers(const std::string& name, NetworkNumbers value) {
        if (value == NetworkNumbers::floats) field(name + "/floats", true);
    }
    /// Writes compressed rows.
    void field(const std::string& group, const SurfaceEmbedding& W, Eigen::Index) {
        file_.add(group + "/row_begin", W.rows() + 1, 1, W.outerIndexPtr());
        file_.add(group + "/columns", W.nonZeros(), 1, W.innerIndexPtr());
        file_.add(group + "/weights", W.nonZeros(), 1, W.valuePtr());
    }
    template <class T, class Fields>
    void optional(std::string_view, const std::optional<T>& value, const Fields& fields) {
        if (value) fields(*this, *value);
    }
    template <class Map, class Fields>
    void entry(std::string_view, const Map& map, const typename Map::key_type& key, const Fields& fields) {
        if (const auto found = map.find(key); found != map.end()) fields(*this, found->second);
    }

    std::vector<std::byte> finish() const { return file_.finish(); }

 private:
    template <class Struct, class T>
    void column(const std::string& name, const std::vector<Struct>& rows, TableColumn<Struct, T> column) {
        if constexpr (EigenMatrix<T>) {
            FlatRows<typename T::Scalar> values(rows.size(), T::SizeAtCompileTime);
            for (std::size_t i = 0; i < rows.size(); ++i)
                values.row(i) = (rows[i].*column.member).template reshaped<Eigen::RowMajor>().transpose();
            field(message(name, '/', column.name), values);
        } else {
            std::vector<FlatStored<T>> values;
            values.reserve(rows.size());
            for (const Struct& row : rows) values.push_back(static_cast<FlatStored<T>>(row.*column.member));
            field(message(name, '/', column.name), values);
        }
    }

    FlatWriter file_;
};

/// Throws like FlatReader, and also on values that a field does not allow.
class FlatFieldReader {
 public:
    /// file: must outlive this object.
    explicit FlatFieldReader(std::span<const std::byte> file) : file_(file) {}

    template <class T>
    requires std::is_arithmetic_v<T>
    void field(std::string_view name, T& value) {
        const auto stored = values<FlatStored<T>>(name, 1, 1);
        value = as<T>(name, stored(0, 0));
    }
    template <FlatNumber T>
    void field(std::string_view name, std::vector<T>& values, Eigen::Index rows, Eigen::Index columns = 1) {
        const FlatRows<T> stored = this->values<T>(name, rows < 0 ? rows : rows * columns, 1);
        values.assign(stored.data(), stored.data() + stored.size());
    }
    template <EigenMatrix M>
    void field(std::string_view name, M& matrix, Eigen::Index rows, Eigen::Index columns = 1) {
        matrix = values<typename M::Scalar>(name, rows, columns);
    }
    void field(std::string_view name, FixedMatrix& matrix, Eigen::Index rows, Eigen::Index columns) {
        matrix = FixedMatrix(values<float>(name, rows, columns));
    }
    void may_be_empty(std::string_view name, auto& value, Eigen::Index rows, Eigen::Index columns = 1) {
        if (const FlatArray& array = file_.array(name); array.rows == 0 || array.columns == 0)
            read_.insert(array.name);
        else
            field(name, value, rows, columns);
    }
    void follows(const std::string& name, auto& value, auto... shape) { field(name, value, shape...); }
    template <class Struct, class... T>
    void table(const std::string& name, std::vector<Struct>& rows, Eigen::Index count,
               TableColumn<Struct, T>... columns) {
        static_assert(is_whole_struct<Struct, T...>, "a member of the struct has no column");
        // Rows without numbers would take no room in the file, but much in memory.
        const FlatArray& first = file_.array(message(name, '/', std::get<0>(std::tuple(columns...)).name));
        if (first.columns == 0) FlatReader::refuse(first.name, "without columns", "1 or more");
        rows.resize(count < 0 ? static_cast<Eigen::Index>(first.rows) : count);
        (column(name, rows, columns), ...);
    }
    void numbers(const std::string& name, NetworkNumbers& value) {
        bool floats = false;
        if (file_.has(name + "/floats")) field(name + "/floats", floats);
        value = floats ? NetworkNumbers::floats : NetworkNumbers::bytes;
    }
    void field(const std::string& group, SurfaceEmbedding& W, Eigen::Index nodes) {
        std::vector<int> row_begin, columns;
        std::vector<float> weights;
        field(group + "/row_begin", row_begin, Eigen::Dynamic);
        field(group + "/columns", columns, Eigen::Dynamic);
        field(group + "/weights", weights, std::ssize(columns));
        W = embedding_of_rows(row_begin, columns, weights, nodes);
    }
    template <class T, class Fields>
    void optional(std::string_view group, std::optional<T>& value, const Fields& fields) {
        if (file_.has(message(group, '/'))) fields(*this, value.emplace());
    }
    template <class Map, class Fields>
    void entry(std::string_view group, Map& map, const typename Map::key_type& key, const Fields& fields) {
        if (file_.has(message(group, '/'))) fields(*this, map[key]);
    }

    /// Counts the arrays whose names begin with `group` as read. Returns whether there are any.
    bool leave_out(std::string_view group) {
        bool any = false;
        for (const FlatArray& array : file_.arrays())
            if (array.name.starts_with(group)) {
                read_.insert(array.name);
                any = true;
            }
        return any;
    }

    /// Throws if an array was not read: a program that knows more fields wrote the file.
    void finish() const {
        for (const FlatArray& array : file_.arrays())
            if (!read_.contains(array.name))
                throw std::runtime_error(
                    message("has an unknown array ", array.name,
                            "; allowed: the arrays that this version of the program knows"));
    }

 private:
    /// Copies an array. rows, columns: the allowed shape; Eigen::Dynamic allows any size.
    template <FlatNumber T>
    FlatRows<T> values(std::string_view name, Eigen::Index rows, Eigen::Index columns) {
        read_.insert(std::string(name));
        const FlatArray& array = file_.array(name);
        check(array, flat_type<T>(), rows, columns);
        FlatRows<T> values(array.rows, array.columns);
        if (values.size() > 0) std::memcpy(values.data(), array.values.data(), array.values.size());
        return values;
    }
    template <class T>
    static T as(std::string_view name, FlatStored<T> stored) {
        if constexpr (std::is_same_v<T, bool>)
            if (stored > 1) FlatReader::refuse(name, std::to_string(stored), "0 or 1");
        return static_cast<T>(stored);
    }
    static void check(const FlatArray& array, std::string_view type, Eigen::Index rows,
                      Eigen::Index columns) {
        const auto shape = [](auto row_count, auto column_count) {
            const auto side = [](auto count) { return count < 0 ? "any" : std::to_string(count); };
            return message(side(row_count), " x ", side(column_count));
        };
        const auto fits = [](std::size_t is, Eigen::Index allowed) {
            return allowed == Eigen::Dynamic || std::cmp_equal(is, allowed);
        };
        if (array.type != type || !fits(array.rows, rows) || !fits(array.columns, columns))
            FlatReader::refuse(array.name,
                               message(shape(static_cast<std::int64_t>(array.rows),
                                             static_cast<std::int64_t>(array.columns)),
                                       " of ", array.type),
                               message(shape(rows, columns), " of ", type));
    }

    template <class Struct, class T>
    void column(const std::string& name, std::vector<Struct>& rows, TableColumn<Struct, T> column) {
        const std::string item = message(name, '/', column.name);
        const Eigen::Index count = rows.size();
        if constexpr (EigenMatrix<T>) {
            const auto stored = values<typename T::Scalar>(item, count, T::SizeAtCompileTime);
            for (Eigen::Index i = 0; i < count; ++i)
                rows[i].*column.member = stored.row(i).template reshaped<Eigen::RowMajor>(
                    T::RowsAtCompileTime, T::ColsAtCompileTime);
        } else {
            const auto stored = values<FlatStored<T>>(item, count, 1);
            for (Eigen::Index i = 0; i < count; ++i) rows[i].*column.member = as<T>(item, stored(i, 0));
        }
    }

    FlatReader file_;
    std::set<std::string, std::less<>> read_;
};

}  // namespace nbd
