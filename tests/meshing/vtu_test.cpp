#include "meshing/formats/vtu.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

std::string read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// An appended array by name; checks its stored length.
template <class T>
std::vector<T> array(const std::string& text, const std::string& name) {
    std::smatch match;
    const std::regex element("Name=\"" + name + "\"[^>]*offset=\"([0-9]+)\"");
    const std::string header = text.substr(0, text.find("<AppendedData"));
    if (!std::regex_search(header, match, element)) return {};
    const std::size_t data = text.find("\n_", header.size()) + 2 + std::stoul(match[1]);
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, text.data() + data, sizeof(bytes));
    std::vector<T> values(bytes / sizeof(T));
    std::memcpy(values.data(), text.data() + data + sizeof(bytes), bytes);
    return values;
}

class Vtu : public ::testing::Test {
 protected:
    test::TemporaryFolder own_;
    const std::filesystem::path folder_ = own_.path() / "frames";
    const TetMesh mesh_ = test::box_mesh({1, 1, 1}, {1, 1, 1});
    const Nodes zero_ = Nodes::Zero(8, 3);
    const Eigen::VectorXd no_stress_ = Eigen::VectorXd::Zero(6);

    /// The mesh at rest.
    VtuBody still() const { return {&mesh_.T, &mesh_.X, &mesh_.X, &zero_, &zero_, &no_stress_}; }
};

TEST_F(Vtu, ContainsPositionsFieldsAndBodyIndicesOfEveryMesh) {
    const Nodes x = mesh_.X.array() + 0.25, v = Nodes::Constant(8, 3, -1.5), force = Nodes::Constant(8, 3, 7);
    const Eigen::VectorXd stress = Eigen::VectorXd::LinSpaced(6, 10, 15);
    const VtuBody bodies[] = {{&mesh_.T, &mesh_.X, &x, &v, &force, &stress},
                              {&mesh_.T, &mesh_.X, &mesh_.X, &v, &force, &stress}};
    std::filesystem::create_directories(folder_);
    write_vtu(folder_ / "frame.vtu", bodies);
    const std::string text = read(folder_ / "frame.vtu");
    EXPECT_NE(text.find("NumberOfPoints=\"16\" NumberOfCells=\"12\""), std::string::npos);
    const auto points = array<float>(text, "points"), displacement = array<float>(text, "displacement"),
               velocity = array<float>(text, "velocity");
    const auto connectivity = array<std::int64_t>(text, "connectivity"),
               offsets = array<std::int64_t>(text, "offsets");
    const auto owner = array<std::int32_t>(text, "body");
    ASSERT_EQ(points.size(), 48u);
    EXPECT_FLOAT_EQ(points[0], 0.25f);
    EXPECT_FLOAT_EQ(points[24], 0.f);
    ASSERT_EQ(displacement.size(), 48u);
    EXPECT_FLOAT_EQ(displacement[5], 0.25f);
    EXPECT_FLOAT_EQ(displacement[30], 0.f);
    ASSERT_EQ(velocity.size(), 48u);
    EXPECT_FLOAT_EQ(velocity[47], -1.5f);
    ASSERT_EQ(connectivity.size(), 48u);
    EXPECT_EQ(connectivity[0], mesh_.T(0, 0));
    EXPECT_EQ(connectivity[24], mesh_.T(0, 0) + 8);
    ASSERT_EQ(offsets.size(), 12u);
    EXPECT_EQ(offsets.back(), 48);
    ASSERT_EQ(owner.size(), 12u);
    EXPECT_EQ(owner[5], 0);
    EXPECT_EQ(owner[6], 1);
    EXPECT_EQ(array<float>(text, "contact_force"), std::vector<float>(48, 7.f));
    const auto von_mises = array<float>(text, "von_mises");
    ASSERT_EQ(von_mises.size(), 12u);
    EXPECT_FLOAT_EQ(von_mises[0], 10.f);
    EXPECT_FLOAT_EQ(von_mises[11], 15.f);
    EXPECT_EQ(array<std::uint8_t>(text, "types"), std::vector<std::uint8_t>(12, 10));
}

TEST_F(Vtu, SeriesListsAllFramesAfterEachFrame) {
    const VtuBody bodies[] = {still()};
    VtuSeries series(folder_, "run");
    for (int f = 0; f < 3; ++f) {
        series.add_frame(0.1 * f, bodies);
        const std::string text = read(series.pvd());
        for (int g = 0; g <= f; ++g) {
            const std::string name = "run_00000" + std::to_string(g) + ".vtu";
            EXPECT_TRUE(std::filesystem::exists(folder_ / name));
            EXPECT_NE(text.find("file=\"" + name + "\""), std::string::npos);
        }
    }
    int files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) ++files;
    EXPECT_EQ(files, 4);  // no temporary file remains
}

TEST_F(Vtu, ReportsInvalidInput) {
    const std::string misfit =
        "vtu: body 1 needs one row per node in every node field, one von_mises per tetrahedron";
    const Nodes seven = Nodes::Zero(7, 3);
    const Eigen::VectorXd one = Eigen::VectorXd::Zero(1);
    for (auto field : {&VtuBody::start, &VtuBody::x, &VtuBody::v, &VtuBody::contact_force}) {
        VtuBody bodies[] = {still(), still()};
        bodies[1].*field = &seven;
        EXPECT_EQ(test::refusal([&] { write_vtu(folder_ / "frame.vtu", bodies); }), misfit);
    }
    VtuBody bodies[] = {still(), still()};
    bodies[1].von_mises = &one;
    EXPECT_EQ(test::refusal([&] { write_vtu(folder_ / "frame.vtu", bodies); }), misfit);
    const VtuBody fine[] = {still()};
    EXPECT_THROW(write_vtu("/nowhere/at/all/frame.vtu", fine), std::runtime_error);
    EXPECT_THROW(VtuSeries("/dev/null/folder", "run"), std::runtime_error);
}

}  // namespace
}  // namespace nbd
