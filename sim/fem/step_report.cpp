#include "sim/fem/step_report.hpp"

#include <cstddef>
#include <type_traits>

namespace nbd {

const char* name(StepTrouble trouble) noexcept {
    // In the order of the enumeration.
    constexpr const char* names[]{"",      "approach", "linear_solver", "newton", "contact_passes",
                                  "joint", "inverted"};
    return names[static_cast<std::size_t>(trouble)];
}

void StepReport::add(const StepReport& other) {
    for (const StepNumber& number : step_numbers)
        if (number.adds)
            std::visit(
                [&](auto member) {
                    if constexpr (std::is_arithmetic_v<std::remove_reference_t<decltype(this->*member)>>)
                        this->*member += other.*member;
                },
                number.member);
}

}  // namespace nbd
