#include "apps/simulate/step_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <type_traits>

namespace nbd {
namespace {

/// The columns of the audit stand before this one.
constexpr std::string_view last_column = "trouble";

template <class Number>
std::string shown(Number number, std::string_view unit) {
    if constexpr (std::is_same_v<Number, StepTrouble>) {
        return name(number);
    } else if constexpr (std::is_same_v<Number, double>) {
        if (std::isinf(number)) return {};
        return unit == "s" || unit == "J" ? fmt::format("{:.9g}", number) : fmt::format("{:.6g}", number);
    } else {
        return fmt::format("{:d}", number);
    }
}

}  // namespace

std::vector<std::pair<std::string, double>> StepTotals::times() const {
    std::vector<std::pair<std::string, double>> means;
    for (const StepNumber& number : step_numbers)
        if (const auto* time = std::get_if<double StepReport::*>(&number.member); time && number.adds)
            means.emplace_back(number.name, mean(*time));
    return means;
}

double StepTotals::step_us() const {
    double sum = 0;
    for (const auto& [name, us] : times()) sum += us;
    return sum;
}

StepTable::StepTable(const std::filesystem::path& path) : file_(path) {
    file_->out() << "frame";
    for (const StepNumber& number : step_numbers) {
        if (number.name == last_column)
            for (const AuditNumber& of_audit : audit_numbers) file_->out() << ',' << of_audit.name;
        file_->out() << ',' << number.name;
    }
    file_->out() << '\n';
}

void StepTable::add(const std::vector<StepRow>& rows) {
    for (const StepRow& row : rows) {
        ++totals_.steps;
        StepReport& all = totals_.all;
        all.add(row);
        all.time = row.time;
        all.least_distance = std::min(all.least_distance, row.least_distance);
        all.inverted_elements = std::max(all.inverted_elements, row.inverted_elements);
        if (row.contacts > 0 && std::exchange(last_frame_in_contact_, row.frame) != row.frame)
            ++totals_.frames_in_contact;
        totals_.troubled_steps += row.trouble != StepTrouble::none;
        totals_.otherwise_troubled_steps +=
            row.trouble != StepTrouble::none && row.trouble != StepTrouble::inverted;
        if (row.inverted_elements > 0 && totals_.inverted_steps++ == 0) totals_.first_inverted = row.time;
        if (row.audit) {
            ++totals_.audited_frames;
            totals_.audit += *row.audit;
        }
        if (file_) write(row);
    }
}

void StepTable::write(const StepRow& row) {
    std::string line = fmt::to_string(row.frame);
    for (const StepNumber& number : step_numbers) {
        if (number.name == last_column)
            for (const AuditNumber& of_audit : audit_numbers) {
                line += ',';
                if (row.audit)
                    std::visit([&](auto member) { line += shown((*row.audit).*member, "us"); },
                               of_audit.member);
            }
        line += ',';
        std::visit([&](auto member) { line += shown(row.*member, number.unit); }, number.member);
    }
    file_->out() << line << '\n';
}

void StepTable::finish() {
    if (file_) file_->commit();
}

}  // namespace nbd
