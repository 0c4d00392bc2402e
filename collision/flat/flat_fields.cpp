#include "collision/flat/flat_fields.hpp"

#include <stdexcept>
#include <utility>

namespace nbd {

bool FlatFieldReader::leave_out(std::string_view group) {
    bool any = false;
    for (const FlatArray& array : file_.arrays())
        if (array.name.starts_with(group)) {
            read_.insert(array.name);
            any = true;
        }
    return any;
}

void FlatFieldReader::finish() const {
    for (const FlatArray& array : file_.arrays())
        if (!read_.contains(array.name))
            throw std::runtime_error(message("has an unknown array ", array.name,
                                             "; allowed: the arrays that this version of the program knows"));
}

void FlatFieldReader::check(const FlatArray& array, std::string_view type, Eigen::Index rows,
                            Eigen::Index columns) {
    const auto shape = [](auto row_count, auto column_count) {
        const auto side = [](auto count) { return count < 0 ? "any" : std::to_string(count); };
        return message(side(row_count), " x ", side(column_count));
    };
    const auto fits = [](std::size_t is, Eigen::Index allowed) {
        return allowed == Eigen::Dynamic || std::cmp_equal(is, allowed);
    };
    if (array.type != type || !fits(array.rows, rows) || !fits(array.columns, columns))
        FlatReader::refuse(
            array.name,
            message(shape(static_cast<std::int64_t>(array.rows), static_cast<std::int64_t>(array.columns)),
                    " of ", array.type),
            message(shape(rows, columns), " of ", type));
}

}  // namespace nbd
