#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "collision/base/message.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/nbd_tree/fixed_point.hpp"

// C++ values as arrays of a flat file. FlatFieldWriter and FlatFieldReader have the same functions, so that
// one list of fields serves for writing and reading.
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

/// A member of the structs of a table: a number or a matrix of fixed size.
template <class Struct, class T>
struct FlatColumn {
    std::string_view name;
    T Struct::*member;
};
template <class Struct, class T>
FlatColumn(const char*, T Struct::*) -> FlatColumn<Struct, T>;

/// Whether the columns make up the whole struct, judged by its size.
template <class Struct, class... T>
constexpr bool is_whole_struct = ((sizeof(T) + ...) + alignof(Struct) - 1) / alignof(Struct) *
                                     alignof(Struct) ==
                                 sizeof(Struct);

class FlatFieldWriter {
 public:
    template <class T>
    requires std::is_arithmetic_v<T>
    void field(std::string_view name, const T& value) {
        const auto stored = static_cast<FlatStored<T>>(value);
        file_.add(name, 1, 1, &stored);
    }
    template <FlatNumber T>
    void field(std::string_view name, const std::vector<T>& values) {
        file_.add(name, values.size(), 1, values.data());
    }
    template <EigenMatrix M>
    void field(std::string_view name, const M& matrix) {
        const FlatRows<typename M::Scalar> rows = matrix;
        file_.add(name, rows.rows(), rows.cols(), rows.data());
    }
    void field(std::string_view name, const FixedMatrix& matrix) { field(name, matrix.numbers()); }
    /// Writes a vector of structs, one array per member.
    template <class Struct, class... T>
    void table(const std::string& name, const std::vector<Struct>& rows, FlatColumn<Struct, T>... columns) {
        static_assert(is_whole_struct<Struct, T...>, "a member of the struct has no column");
        (column(name, rows, columns), ...);
    }
    /// Calls fields(writer, value) if there is a value.
    template <class T, class Fields>
    void optional(std::string_view, const std::optional<T>& value, const Fields& fields) {
        if (value) fields(*this, *value);
    }

    /// Calls fields(writer, value) if the map has a value for the key.
    template <class Map, class Fields>
    void entry(std::string_view, const Map& map, const typename Map::key_type& key, const Fields& fields) {
        if (const auto found = map.find(key); found != map.end()) fields(*this, found->second);
    }

    std::vector<std::byte> finish() const { return file_.finish(); }

 private:
    template <class Struct, class T>
    void column(const std::string& name, const std::vector<Struct>& rows, FlatColumn<Struct, T> column) {
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
    void field(std::string_view name, std::vector<T>& values) {
        const FlatRows<T> stored = this->values<T>(name, Eigen::Dynamic, 1);
        values.assign(stored.data(), stored.data() + stored.size());
    }
    template <EigenMatrix M>
    void field(std::string_view name, M& matrix) {
        matrix = values<typename M::Scalar>(name, M::RowsAtCompileTime, M::ColsAtCompileTime);
    }
    void field(std::string_view name, FixedMatrix& matrix) {
        Eigen::MatrixXf numbers;
        field(name, numbers);
        matrix = FixedMatrix(numbers);
    }
    template <class Struct, class... T>
    void table(const std::string& name, std::vector<Struct>& rows, FlatColumn<Struct, T>... columns) {
        static_assert(is_whole_struct<Struct, T...>, "a member of the struct has no column");
        // Rows without numbers would take no room in the file, but much in memory.
        const FlatArray& first = file_.array(message(name, '/', std::get<0>(std::tuple(columns...)).name));
        if (first.columns == 0) FlatReader::refuse(first.name, "without columns", "1 or more");
        rows.resize(first.rows);
        (column(name, rows, columns), ...);
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
    bool leave_out(std::string_view group);

    /// Throws if an array was not read: a program that knows more fields wrote the file.
    void finish() const;

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
    static void check(const FlatArray& array, std::string_view type, Eigen::Index rows, Eigen::Index columns);

    template <class Struct, class T>
    void column(const std::string& name, std::vector<Struct>& rows, FlatColumn<Struct, T> column) {
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
