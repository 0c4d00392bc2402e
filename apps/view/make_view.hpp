#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/view/contact_finder.hpp"
#include "apps/view/posed_view.hpp"
#include "apps/view/view_scene.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// A body that a page is to show.
struct ViewSource {
    std::string name;
    ViewTree tree;
    Vertices start{};                              // see ViewBody; empty: no displacement is shown
    Vertices rest{};                               // [n, 3] surface at rest; needed only for self-contact
    std::shared_ptr<const ElasticBody> elastic{};  // null: no stress is shown
    bool has_forces = false;                       // whether frames have its contact forces
};

/// A frame as it is shown, whether a run has just made it or a recording holds it.
struct ShownFrame {
    std::vector<Vertices> nodes{};           // [bodies], [N, 3] metres
    std::vector<Vertices> contact_forces{};  // [bodies], [N, 3] newtons; empty for a body without them
    std::vector<ViewReaction> reactions{};   // if the scene has them
};

/// What a page shows, without the frames.
struct ViewSources {
    std::vector<ViewSource> bodies;
    std::vector<Obstacle> obstacles;
    double contact_distance = 0;  // metres; 0: only intersecting faces are marked
    bool self_contact = false;
};

/// The bodies and obstacles of a scene, without starts and contact forces. spec: with the bounds that are to
/// be drawn and audited. bodies: as loaded from its files. world: built of them; the sources refer to it.
ViewSources sources_of_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                             std::shared_ptr<const World> world);

/// torque, point: as a reaction has them, see Reaction. origin: that positions of the page are counted from.
ViewReaction view_reaction(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& torque,
                           const Eigen::Vector3d& point, const Eigen::Vector3d& origin);

/// For titles: ", from (x, y, z) m", or nothing for zero.
std::string from_origin(const Eigen::Vector3d& origin);

/// Which way is up in a scene: against gravity, if there is any.
Eigen::Vector3d up_of(const SceneSpec& spec);

/// At most `most` of the frames 0 to count - 1, evenly spread, with the first and the last one. most: >= 1.
std::vector<int> even_frames(int count, int most);

/// Makes what a page shows, frame by frame.
class ViewMaker {
 public:
    /// Throws std::invalid_argument for bounds that a tree does not have.
    explicit ViewMaker(ViewSources sources);

    /// Adds the bodies and obstacles, without frames, to a scene.
    void begin(ViewScene& scene);

    /// Appends a frame to what begin() added: the one of scene.times[number] and scene.numbers[number], in
    /// order.
    void add_frame(std::size_t number, const ShownFrame& frame, ViewScene& scene);

 private:
    ViewSources sources_;
    std::deque<PosedView> posed_;
    std::optional<ContactFinder> contacts_;
};

/// Shows surfaces without nodes, each in one pose. poses: [bodies], [n, 3]. distance: of faces that are
/// marked as near, metres; 0: only intersecting ones are marked.
ViewScene view_of_surfaces(std::vector<ViewSource> surfaces, std::vector<Vertices> poses,
                           const std::string& title, double distance);

}  // namespace nbd
