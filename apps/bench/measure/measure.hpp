#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace nbd {

/// Description of the machine for tables of times: CPU, instruction set, cores, caches and compiler. Leaves
/// out what the system does not report.
std::string this_machine();

/// Bytes that the program has allocated and not freed; 0 if the C library does not report them.
std::size_t heap_bytes();

/// Processor time of all threads of the program, in seconds, which other programs on the machine hardly
/// change.
double processor_seconds();

/// The value that a share of the values is below, share in [0, 1); 0 if there are no values.
inline double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
    std::ranges::nth_element(values, at);
    return *at;
}

/// Median; the upper one of two middle values, 0 if there are no values.
inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

/// 0 if there are no values.
inline double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace nbd
