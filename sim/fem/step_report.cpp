#include "sim/fem/step_report.hpp"

#include <type_traits>

namespace nbd {

const char* name(StepTrouble trouble) noexcept {
    switch (trouble) {
        case StepTrouble::none:
            return "";
        case StepTrouble::approach:
            return "approach";
        case StepTrouble::linear_solver:
            return "linear_solver";
        case StepTrouble::newton:
            return "newton";
        case StepTrouble::overlap:
            return "overlap";
        case StepTrouble::contact_passes:
            return "contact_passes";
        case StepTrouble::inverted:
            return "inverted";
    }
    return "";
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
