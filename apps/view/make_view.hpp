#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/contact_finder.hpp"
#include "apps/view/posed_view.hpp"
#include "apps/view/view_scene.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// A body that a page is to show.
struct ViewSource {
    std::string name;
    ViewTree tree;
    Vertices start{};                              // see ViewBody; empty: no displacement is shown
    Vertices rest{};                               // [n, 3] surface at rest; needed only for self-contact
    std::shared_ptr<const ElasticBody> elastic{};  // null: no stress is shown
    bool has_forces = false;                       // whether read_forces() knows its contact forces
};

/// How a page is made from poses.
struct ViewSources {
    std::vector<ViewSource> bodies;
    std::vector<Obstacle> obstacles;
    double contact_distance = 0;  // metres; 0: only intersecting faces are marked
    bool self_contact = false;
    /// The nodes, [N, 3] metres, or the contact forces at them, newtons, of a body in a frame. frame: an
    /// element of ViewScene::numbers.
    std::function<void(int body, int frame, Vertices&x)> read_nodes, read_forces;
    /// Hears how many frames are done; may be empty.
    std::function<void(int done, int total)> progress;
};

/// At most `most` of the frames 0 to count - 1, evenly spread, with the first and the last one. most: >= 1.
std::vector<int> even_frames(int count, int most);

/// What a recording holds for a page: a scene that has its times and numbers, and where the rest is from.
struct ShownRecording {
    ViewScene scene;
    ViewSources sources;
    std::vector<std::filesystem::path> inputs{};       // that its scene names
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // what its positions are counted from, metres
};

/// Makes what a page shows, frame by frame.
class ViewMaker {
 public:
    /// Throws std::invalid_argument for bounds that a tree does not have.
    explicit ViewMaker(ViewSources sources);

    /// Adds the bodies and obstacles, without frames, to a scene.
    void begin(ViewScene& scene);

    /// Appends a frame to what begin() added: one of scene.times and scene.numbers, in order. Throws what
    /// reading throws.
    void add_frame(std::size_t frame, ViewScene& scene);

 private:
    ViewSources sources_;
    std::deque<PosedView> posed_;
    std::optional<ContactFinder> contacts_;
    Vertices x_;
};

/// Adds bodies, obstacles and contacts in all frames to a scene that has its times and numbers. Throws what
/// reading throws, and std::invalid_argument for bounds that a tree does not have.
void make_view(const ViewSources& sources, ViewScene& scene);

/// Shows surfaces without nodes, each in one pose, [n, 3]. distance: of faces that are marked as near,
/// metres; 0: only intersecting ones are marked.
ViewScene view_of_surfaces(std::vector<ViewSource> surfaces, const std::vector<Vertices>& poses,
                           const std::string& title, double distance);

}  // namespace nbd
