#include "apps/extras/extras_request.hpp"

#include <utility>

#include "sim/fem/stress.hpp"

namespace nbd {

void add_extras_options(CLI::App& command, ExtrasRequest& request) {
    using enum FrameField;
    command.add_flag("--contact-forces", request.fields[contact_forces],
                     "Also record the contact forces on the nodes, which `view` can show");
    command.add_flag("--stress", request.fields[first_piola_stress],
                     "Also record the first Piola-Kirchhoff stress of every tetrahedron, Pa");
    command.add_flag("--deformation-gradients", request.fields[deformation_gradients],
                     "Also record the deformation gradient of every tetrahedron");
    command.add_flag("--contact-edges", request.contact_edges,
                     "Also record which faces touch: other bodies, obstacles and the body itself");
}

void add_fields(const ExtrasRequest& request, const ElasticBody& body, NodesRef x,
                const Nodes& contact_forces, FrameExtras& extras) {
    constexpr auto stresses = FrameField::first_piola_stress, gradients = FrameField::deformation_gradients;
    if (request.fields[FrameField::contact_forces])
        extras.fields[FrameField::contact_forces] = contact_forces.cast<float>();
    if (!request.fields[stresses] && !request.fields[gradients]) return;
    ElementStress stress = element_stress(body, x);
    if (request.fields[stresses]) extras.fields[stresses] = std::move(stress.P);
    if (request.fields[gradients]) extras.fields[gradients] = std::move(stress.F);
}

}  // namespace nbd
