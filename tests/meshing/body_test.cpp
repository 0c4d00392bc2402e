#include "meshing/body/body.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <sstream>

#include "meshing/surface/quadratic_tets.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd {
namespace {

using test::EditFile;
using test::error_of;
using BodyFile = test::FileTest;

/// Two tetrahedra that share a face, with a surface of 6 faces over their 5 nodes and 4 modes.
Body two_tets() {
    Body body;
    body.name = "two tets";
    body.tets.X.resize(5, 3);
    body.tets.X << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1. / 3;
    body.tets.T.resize(2, 4);
    body.tets.T << 0, 1, 2, 3, 1, 4, 2, 3;
    body.surface = {body.tets.X, boundary_faces(body.tets)};
    body.W.resize(5, 5);
    body.W.setIdentity();
    body.material = {2e5, 0.3, 900, 0.2, 2e-3, MaterialLaw::stable_neo_hookean};
    body.regions = {{.name = "upper/half", .material = body.material, .tets = {1}}};
    body.regions[0].material.law = MaterialLaw::st_venant_kirchhoff;
    body.regions[0].material.young = 3e6;
    body.face_groups = {{.name = "front/left", .faces = {0, 2, 5}},
                        {.name = "all", .faces = {0, 1, 2, 3, 4, 5}}};
    std::srand(3);
    body.modes.U = Eigen::MatrixXf::Random(15, 4);
    body.modes.frequencies.resize(4);
    body.modes.frequencies << 1, 2, 2, 1. / 3 + 3;
    return body;
}

void expect_same(const Body& a, const Body& b) {
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.tets.X, b.tets.X);
    EXPECT_EQ(a.tets.T, b.tets.T);
    EXPECT_EQ(a.surface.X, b.surface.X);
    EXPECT_EQ(a.surface.F, b.surface.F);
    EXPECT_EQ(Eigen::MatrixXd(a.W), Eigen::MatrixXd(b.W));
    EXPECT_TRUE(a.material == b.material);
    EXPECT_TRUE(a.regions == b.regions);
    EXPECT_TRUE(a.face_groups == b.face_groups);
    EXPECT_EQ(a.modes.U, b.modes.U);
    EXPECT_EQ(a.modes.frequencies, b.modes.frequencies);
}

TEST_F(BodyFile, RoundTripsABody) {
    const Body body = two_tets();
    save_body(folder / "body.h5", body);
    expect_same(load_body(folder / "body.h5"), body);
    EXPECT_EQ(files_in_folder(), 1u);
}

/// On quadratic tetrahedra.
Body ten_nodes() {
    Body body = two_tets();
    body.modes = {};
    body.tets = make_quadratic(body.tets);
    body.W.conservativeResize(5, body.tets.X.rows());
    return body;
}

TEST_F(BodyFile, RoundTripsQuadraticTetrahedra) {
    const Body body = ten_nodes();
    save_body(folder / "body.h5", body);
    const Body read = load_body(folder / "body.h5");
    expect_same(read, body);
    EXPECT_EQ(read.tets.E, body.tets.E);
    EXPECT_NE(body_hash(body), body_hash(two_tets()));
}

/// Filled in part.
Body hollow() {
    Body body = ten_nodes();
    body.tets.fill = TetFill::Constant(2, 10, 0.1);
    body.tets.fill.row(1) << 0.05, 0.05, 0.05, 0.05, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07;
    return body;
}

TEST_F(BodyFile, RoundTripsFill) {
    const Body body = hollow();
    save_body(folder / "body.h5", body);
    const Body read = load_body(folder / "body.h5");
    expect_same(read, body);
    EXPECT_EQ(read.tets.fill, body.tets.fill);
    EXPECT_NE(body_hash(body), body_hash(ten_nodes()));
}

TEST_F(BodyFile, RejectsFillThatIsNone) {
    Body few = hollow();
    few.tets.fill.conservativeResize(1, Eigen::NoChange);
    EXPECT_EQ(error_of([&] { check_body(few); }), "fill of 1 tetrahedra; allowed: 2, of all");
    for (const double wrong : {-0.2, 0.9, std::numeric_limits<double>::quiet_NaN()}) {
        Body body = hollow();
        body.tets.fill(1, 3) = wrong;
        EXPECT_THAT(error_of([&] { check_body(body); }), testing::HasSubstr("fill of tetrahedron 1"));
    }
    Body empty = hollow();
    empty.tets.fill.row(0).setZero();
    EXPECT_THAT(error_of([&] { check_body(empty); }), testing::HasSubstr("fill of tetrahedron 0: 0 in all"));
}

TEST_F(BodyFile, RejectsQuadraticTetrahedraThatAreNone) {
    Body bent = ten_nodes();
    bent.tets.X(bent.tets.E(0, 2), 1) += 0.01;
    EXPECT_THAT(error_of([&] { check_body(bent); }), testing::HasSubstr("beside the middle of its edge"));
    Body few = ten_nodes();
    few.tets.E.conservativeResize(1, Eigen::NoChange);
    EXPECT_EQ(error_of([&] { check_body(few); }), "nodes of the edges of 1 tetrahedra; allowed: 2, of all");
    Body cracked = ten_nodes();
    const int common = cracked.tets.E(0, 3), more = static_cast<int>(cracked.tets.X.rows());
    cracked.tets.X.conservativeResize(more + 1, Eigen::NoChange);
    cracked.tets.X.row(more) = cracked.tets.X.row(common);
    cracked.tets.E(0, 3) = more;
    cracked.W.conservativeResize(5, more + 1);
    EXPECT_THAT(error_of([&] { check_body(cracked); }), testing::HasSubstr("; allowed: one"));
    Body wrong = ten_nodes();
    wrong.tets.E(1, 3) = 99;
    EXPECT_THAT(error_of([&] { check_body(wrong); }),
                testing::HasSubstr("edges of tetrahedron 1 refers to node 99"));
}

TEST_F(BodyFile, NeedsNoModes) {
    Body body = two_tets();
    body.modes = {};
    save_body(folder / "body.h5", body);
    EXPECT_EQ(load_body(folder / "body.h5").modes.count(), 0);
}

TEST_F(BodyFile, HasTheSameBytesForTheSameBody) {
    save_body(folder / "a.h5", two_tets());
    save_body(folder / "b.h5", two_tets());
    EXPECT_TRUE(test::read_bytes(folder / "a.h5") == test::read_bytes(folder / "b.h5"));
}

TEST(BodyHash, DependsOnlyOnTheGeometry) {
    const std::string hash = body_hash(two_tets());
    EXPECT_EQ(hash.size(), 64u);
    Body other = two_tets();
    other.name = "x";
    other.material.young = 1;
    other.regions.clear();
    other.modes = {};
    EXPECT_EQ(body_hash(other), hash);
    other.tets.X(4, 2) = std::nextafter(other.tets.X(4, 2), 1.);
    EXPECT_NE(body_hash(other), hash);
    other = two_tets();
    std::swap(other.surface.F(0, 0), other.surface.F(0, 1));
    EXPECT_NE(body_hash(other), hash);
    other = two_tets();
    other.W.coeffRef(0, 0) = 0.5;
    EXPECT_NE(body_hash(other), hash);
}

TEST_F(BodyFile, RefusesToSaveABodyThatWouldNotLoad) {
    Body body = two_tets();
    body.material.poisson = 0.5;
    const auto path = folder / "body.h5";
    EXPECT_EQ(error_of([&] { save_body(path, body); }),
              path.string() + ": Poisson's ratio is 0.5; allowed: between -0.999 and 0.4999");
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(BodyFile, DetectsRandomDamage) {
    const auto path = folder / "body.h5";
    save_body(path, two_tets());
    test::expect_damage_is_found(path, [](const auto& file) {
        const Body b = load_body(file);
        std::ostringstream text;
        text << body_hash(b) << b.name << b.material.young << b.material.rayleigh_stiffness << b.modes.U
             << b.modes.frequencies << name(b.material.law);
        for (const MaterialRegion& region : b.regions) {
            text << region.name << region.material.young << name(region.material.law);
            for (const int t : region.tets) text << ' ' << t;
        }
        return text.str();
    });
}

class BrokenBodyFile : public BodyFile, public ::testing::WithParamInterface<test::BrokenFile> {};

TEST_P(BrokenBodyFile, IsRejectedInOneLine) {
    const auto path = folder / "body.h5";
    save_body(path, two_tets());
    test::expect_refused(path, GetParam(), [](const auto& file) { load_body(file); });
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

const test::BrokenFile broken_bodies[] = {
    {"is a file of format 'nbdtree tree'; allowed: 'nbdtree body'",
     [](EditFile& f) { f.set_attribute("/", "format", "nbdtree tree"); }},
    {"is an HDF5 file without attribute 'format'; allowed: a file written by nbdtree",
     [](EditFile& f) { f.remove_attribute("/", "format"); }},
    {"is a file of 'nbdtree body' version 4 from nbdtree ",
     [](EditFile& f) { f.set_attribute("/", "format_version", 4); }},
    {"material has the law \"jelly\"; allowed: corotated, stable_neo_hookean, st_venant_kirchhoff",
     [](EditFile& f) { f.set_attribute("material", "law", "jelly"); }},
    {"region \"upper/half\": it has tetrahedron 2; allowed: 0 to 1",
     [](EditFile& f) { f.set("regions/000/tets", 0, 2); }},
    {"region \"upper/half\": its damping differs; allowed: that of the body",
     [](EditFile& f) { f.set_attribute("regions/000", "rayleigh_mass", 0.3); }},
    {"has format_version 0; allowed: a positive number",
     [](EditFile& f) { f.set_attribute("/", "format_version", 0); }},
    {"attribute 'format_version' is not a whole number; allowed: one int64",
     [](EditFile& f) { f.set_attribute("/", "format_version", "one"); }},
    {"has no 'tets/cells'", [](EditFile& f) { f.remove("tets/cells"); }},
    {"has no 'tets/nodes'; allowed: a file with this item", [](EditFile& f) { f.remove("tets"); }},
    {"dataset 'tets/nodes' holds float32; allowed: float64",
     [](EditFile& f) {
         f.replace("tets/nodes", {5, 3}, std::vector<float>(15));
     }},
    {"dataset 'tets/nodes' is 5 x 2; allowed: n x 3",
     [](EditFile& f) {
         f.replace("tets/nodes", {5, 2}, std::vector<double>(10));
     }},
    {"dataset 'surface/faces' is 18; allowed: n x 3",
     [](EditFile& f) { f.replace("surface/faces", {18}, std::vector<int>(18)); }},
    {"3 nodes and 2 tetrahedra; allowed: at least 4 and 1",
     [](EditFile& f) {
         f.replace("tets/nodes", {3, 3}, std::vector<double>(9));
         f.replace("embedding/cols", {5}, std::vector<int>(5));
         f.remove("modes");
     }},
    {"node 4 is not finite", [](EditFile& f) { f.set("tets/nodes", 13, nan); }},
    {"tetrahedron 1 refers to node 5; allowed: 0 to 4", [](EditFile& f) { f.set("tets/cells", 5, 5); }},
    {"tetrahedron 0 has volume -0.167 m3; allowed: more than 0",
     [](EditFile& f) { f.set("tets/cells", 0, 1), f.set("tets/cells", 1, 0); }},
    {"face 2 refers to vertex -1; allowed: 0 to 4", [](EditFile& f) { f.set("surface/faces", 6, -1); }},
    {"surface vertex 0 is not finite", [](EditFile& f) { f.set("surface/vertices", 0, nan); }},
    {"dataset 'embedding/rows' is 5; allowed: 6",
     [](EditFile& f) { f.replace("embedding/rows", {5}, std::vector<int>(5)); }},
    {"embedding/rows spans 1 to 5; allowed: 0 to 5", [](EditFile& f) { f.set("embedding/rows", 0, 1); }},
    {"embedding/rows falls after row 2", [](EditFile& f) { f.set("embedding/rows", 2, 4); }},
    {"embedding/cols: row 3 refers to column 9; allowed: 0 to 4",
     [](EditFile& f) { f.set("embedding/cols", 3, 9); }},
    {"weights of surface vertex 1 sum to 1.5; allowed: 1",
     [](EditFile& f) { f.set("embedding/values", 1, 1.5); }},
    {"surface vertex 2 lies 1 m away from its embedded position",
     [](EditFile& f) { f.set("embedding/cols", 2, 0); }},
    {"the SHA-256 of the content is",
     [](EditFile& f) { f.set("tets/nodes", 14, 0.34), f.set("surface/vertices", 14, 0.34); }},
    {"Young's modulus is 0; allowed: between 1e-30 and 1e30 Pa",
     [](EditFile& f) { f.set_attribute("material", "young", 0.); }},
    {"density is nan", [](EditFile& f) { f.set_attribute("material", "density", nan); }},
    {"has no attribute 'poisson' of 'material'",
     [](EditFile& f) { f.remove_attribute("material", "poisson"); }},
    {"dataset 'modes/U' is 15 x 4; allowed: 15 x 3",
     [](EditFile& f) {
         f.replace("modes/frequencies", {3}, std::vector<double>{1, 2, 3});
     }},
    {"row of modes 7 is not finite", [](EditFile& f) { f.set("modes/U", 30, static_cast<float>(nan)); }},
    {"frequency 1 is 0.5 Hz; allowed: finite, at least 1",
     [](EditFile& f) { f.set("modes/frequencies", 1, 0.5); }},
    {"dataset 'tets/nodes' is 1000000000 x 3; allowed: a size that the file can hold",
     [](EditFile& f) {
         f.reserve("tets/nodes", {1000000000, 3});
     }},
};

INSTANTIATE_TEST_SUITE_P(All, BrokenBodyFile, ::testing::ValuesIn(broken_bodies));

}  // namespace
}  // namespace nbd
