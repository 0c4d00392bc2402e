#include "meshing/formats/vtu.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <regex>
#include <string>

#include "meshing/formats/read_tets.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

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
    VtuBody still() const { return {&mesh_, &mesh_.X, &mesh_.X, &zero_, &zero_, &no_stress_}; }
};

TEST_F(Vtu, HasQuadraticCellsWithPointsOnTheirCurvedEdges) {
    const TetMesh mesh = make_quadratic(test::box_mesh({1, 1, 1}, {1, 1, 1}));
    Nodes x = mesh.X;
    const int edge = mesh.E(2, 1), a = mesh.T(2, 0), b = mesh.T(2, 2);
    x.row(edge) += Eigen::RowVector3d(0, 0, 0.2);
    const Nodes zero = Nodes::Zero(x.rows(), 3);
    const VtuBody bodies[] = {{&mesh, &mesh.X, &x, &zero, &zero, &no_stress_}};
    std::filesystem::create_directories(folder_);
    write_vtu(folder_ / "frame.vtu", bodies);
    const std::string text = test::read_bytes(folder_ / "frame.vtu");
    EXPECT_EQ(array<std::uint8_t>(text, "types"), std::vector<std::uint8_t>(6, 24));
    const std::vector<float> points = array<float>(text, "points");
    const Eigen::Map<const Vertices> all(points.data(), std::ssize(points) / 3, 3);
    const Eigen::RowVector3f middle = (0.5 * x.row(edge) + 0.25 * (x.row(a) + x.row(b))).cast<float>();
    EXPECT_LT((all.row(edge) - middle).norm(), 1e-6);
    // VTK's order: edges 01 12 20 03 13 23.
    const std::vector<std::int64_t> cells = array<std::int64_t>(text, "connectivity");
    const Eigen::RowVector3f other = all.row(cells[10 * 2 + 4 + 2]),
                             ends = (all.row(cells[10 * 2 + 2]) + all.row(cells[10 * 2])) / 2;
    EXPECT_NEAR((other - ends).norm(), 0.1, 1e-6);
}

TEST_F(Vtu, ContainsPositionsFieldsAndBodyIndicesOfEveryMesh) {
    const Nodes x = mesh_.X.array() + 0.25, v = Nodes::Constant(8, 3, -1.5), force = Nodes::Constant(8, 3, 7);
    const Eigen::VectorXd stress = Eigen::VectorXd::LinSpaced(6, 10, 15);
    const VtuBody bodies[] = {{&mesh_, &mesh_.X, &x, &v, &force, &stress},
                              {&mesh_, &mesh_.X, &mesh_.X, &v, &force, &stress}};
    std::filesystem::create_directories(folder_);
    write_vtu(folder_ / "frame.vtu", bodies);
    const std::string text = test::read_bytes(folder_ / "frame.vtu");
    EXPECT_NE(text.find("NumberOfPoints=\"16\" NumberOfCells=\"12\""), std::string::npos);
    const auto second = [](float first, float then) {  // 24 numbers of each body
        std::vector<float> values(48, first);
        std::fill(values.begin() + 24, values.end(), then);
        return values;
    };
    const auto points = array<float>(text, "points");
    ASSERT_EQ(points.size(), 48u);
    EXPECT_FLOAT_EQ(points[0], 0.25f);
    EXPECT_FLOAT_EQ(points[24], 0.f);
    EXPECT_EQ(array<float>(text, "displacement"), second(0.25f, 0));
    EXPECT_EQ(array<float>(text, "velocity"), second(-1.5f, -1.5f));
    EXPECT_EQ(array<float>(text, "contact_force"), second(7, 7));
    EXPECT_EQ(array<float>(text, "von_mises"),
              (std::vector<float>{10, 11, 12, 13, 14, 15, 10, 11, 12, 13, 14, 15}));
    const auto connectivity = array<std::int64_t>(text, "connectivity");
    ASSERT_EQ(connectivity.size(), 48u);
    EXPECT_EQ(connectivity[0], mesh_.T(0, 0));
    EXPECT_EQ(connectivity[24], mesh_.T(0, 0) + 8);
    EXPECT_EQ(array<std::int64_t>(text, "offsets").back(), 48);
    EXPECT_EQ(array<std::int32_t>(text, "body"),
              (std::vector<std::int32_t>{0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1}));
    EXPECT_EQ(array<std::uint8_t>(text, "types"), std::vector<std::uint8_t>(12, 10));
}

TEST_F(Vtu, SeriesListsAllFramesAfterEachFrame) {
    const VtuBody bodies[] = {still()};
    VtuSeries series(folder_, "run");
    for (int f = 0; f < 3; ++f) {
        series.add_frame(0.1 * f, bodies);
        const std::string text = test::read_bytes(series.pvd());
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

const std::string head = R"(<?xml version="1.0"?>
<!-- two tetrahedra and a triangle -->
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32"{}>
<UnstructuredGrid>
<Piece NumberOfPoints="5" NumberOfCells="3">
)";

const std::string text_body =
    R"(<PointData><DataArray type="Float32" Name="u" format="ascii">1 2 3 4 5</DataArray></PointData>
<Points><DataArray type="Float64" Name="p" NumberOfComponents="3" format="ascii">
0 0 0  1 0 0  0 1 0  0 0 1  1 1 1.5
</DataArray></Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 1 2 3 4 0 1 2</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4 8 11</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10 10 5</DataArray>
</Cells>
</Piece></UnstructuredGrid>
</VTKFile>
)";

class ReadVtu : public testing::Test {
 protected:
    TetMesh read(const std::string& text) { return read_tets(folder.write("a.vtu", text)); }
    std::string refusal(const std::string& text) {
        const auto path = folder.write("a.vtu", text);
        return test::error_of([&] { read_tets(path); });
    }
    static std::string whole(const std::string& body, const std::string& more = "") {
        return fmt::format(fmt::runtime(head), more) + body;
    }
    static void expect_two(const TetMesh& tets) {
        EXPECT_EQ(tets.X, (Nodes(5, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1.5).finished());
        EXPECT_EQ(tets.T, (Tets(2, 4) << 0, 1, 2, 3, 1, 2, 3, 4).finished());
    }

    test::TemporaryFolder folder;
};

TEST_F(ReadVtu, ReadsText) { expect_two(read(whole(text_body))); }

TEST_F(ReadVtu, ReadsBase64PlainAndPacked) {
    // Made by Python's struct, zlib and base64: header and data of an array encoded together, or apart if
    // packed.
    const std::string plain = R"(<Points><DataArray type="Float32" NumberOfComponents="3" format="binary">
PAAAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAgD8AAIA/AADAPw==
</DataArray></Points><Cells>
<DataArray type="Int32" Name="connectivity" format="binary">LAAAAAAAAAABAAAAAgAAAAMAAAABAAAAAgAAAAMAAAAEAAAAAAAAAAEAAAACAAAA</DataArray>
<DataArray type="UInt8" Name="offsets" format="binary">AwAAAAQICw==</DataArray>
<DataArray type="UInt8" Name="types" format="binary">AwAAAAoKBQ==</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>)";
    expect_two(read(whole(plain)));
    const std::string packed = R"(<Points><DataArray type="Float32" NumberOfComponents="3" format="binary">
AgAAAB4AAAAAAAAAEAAAABIAAAA=eJxjYEAGDfYoXAYAC88AwHica7BnQAEN9gh8wB4ALaUD/A==
</DataArray></Points><Cells>
<DataArray type="Int32" Name="connectivity" format="binary">AgAAABYAAAAAAAAAEwAAABYAAAA=eJxjYGBgYARiJiBmhrMBAGwACnicY2BgZmBgYGGAAEYgZgJiAACiAAs=</DataArray>
<DataArray type="UInt8" Name="offsets" format="binary">AgAAAAIAAAABAAAACgAAAAkAAAA=eJxj4QAAABIADXic4wYAAAwADA==</DataArray>
<DataArray type="UInt8" Name="types" format="binary">AgAAAAIAAAABAAAACgAAAAkAAAA=eJzj4gIAACAAFXicYwUAAAYABg==</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>)";
    expect_two(read(whole(packed, " compressor=\"vtkZLibDataCompressor\"")));
}

TEST_F(ReadVtu, ReadsAppendedBase64) {
    const std::string appended =
        R"(<Points><DataArray type="Float32" NumberOfComponents="3" format="appended" offset="0"/>
</Points><Cells>
<DataArray type="Int32" Name="connectivity" format="appended" offset="88"/>
<DataArray type="UInt8" Name="offsets" format="appended" offset="152"/>
<DataArray type="UInt8" Name="types" format="appended" offset="164"/></Cells></Piece></UnstructuredGrid>
<AppendedData encoding="base64">
_PAAAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAgD8AAIA/AADAPw==)"
        R"(LAAAAAAAAAABAAAAAgAAAAMAAAABAAAAAgAAAAMAAAAEAAAAAAAAAAEAAAACAAAA)"
        R"(AwAAAAQICw==AwAAAAoKBQ==
</AppendedData></VTKFile>)";
    expect_two(read(whole(appended)));
}

TEST_F(ReadVtu, ReadsWhatTheWriterWrites) {
    const TetMesh tets = read(whole(text_body));
    const Nodes zero = Nodes::Zero(tets.X.rows(), 3);
    const Eigen::VectorXd stress = Eigen::VectorXd::Zero(tets.T.rows());
    const VtuBody body{&tets, &tets.X, &tets.X, &zero, &zero, &stress};
    write_vtu(folder / "two.vtu", std::vector{body, body});
    EXPECT_EQ(test::error_of([&] { read_tets(folder / "two.vtu"); }), "")
        << "two bodies are two pieces of one mesh";
    const TetMesh read = read_tets(folder / "two.vtu");
    EXPECT_EQ(read.X.topRows(5), tets.X);
    EXPECT_EQ(read.T.topRows(2), tets.T);
    EXPECT_EQ(read.T.rows(), 4);
}

TEST_F(ReadVtu, JoinsPieces) {
    const std::string piece = text_body.substr(0, text_body.find("</UnstructuredGrid>"));
    const TetMesh two = read(whole(piece + "<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n" +
                                   test::replaced(text_body, "1 1 1.5", "1 1 2.5")));
    EXPECT_EQ(two.X.rows(), 10);
    EXPECT_EQ(two.T.row(3), Eigen::RowVector4i(6, 7, 8, 9));
}

TEST_F(ReadVtu, NamesWhatIsWrong) {
    const std::string good = whole(text_body);
    const std::vector<std::pair<std::string, std::string>> cases = {
        {test::replaced(good, "type=\"UnstructuredGrid\"", "type=\"PolyData\""),
         "holds PolyData; allowed: UnstructuredGrid"},
        {test::replaced(good, "UInt32", "UInt16"), "header_type is UInt16; allowed: UInt32, UInt64"},
        {whole(text_body, " compressor=\"vtkLZ4DataCompressor\""),
         "compressor is vtkLZ4DataCompressor; allowed: vtkZLibDataCompressor, or none"},
        {test::replaced(good, "NumberOfPoints=\"5\"", "NumberOfPoints=\"4\""),
         "points hold 15 numbers; allowed: 12"},
        {test::replaced(good, "NumberOfPoints=\"5\"", "NumberOfPoints=\"-5\""), "NumberOfPoints is '-5'"},
        {test::replaced(good, "4 8 11", "4 3 11"), "the offsets of cells must rise"},
        {test::replaced(good, "4 8 11", "4 8 12"), "corners of cells hold 11 numbers; allowed: 12"},
        {test::replaced(good, "10 10 5", "10 12 5"), "cell 1 is a volume of type 12 with 4 corners"},
        {test::replaced(good, "1 2 3 4 0", "1 2 3 5 0"), "cell 1 refers to point 5; allowed: 0 to 4"},
        {test::replaced(good, "Name=\"types\"", "Name=\"kinds\""), "the piece has no types of cells"},
        {test::replaced(good, "type=\"Int32\"", "type=\"Float32\""),
         "offsets of cells are of type Float32; allowed: integers"},
        {test::replaced(good, "1.5", "x"), "points hold 'x'; allowed: numbers"},
        {good.substr(0, good.size() - 12), "the file ends early, without </VTKFile>"},
        {"solid", "not a VTK file"}};
    for (const auto& [text, problem] : cases)
        EXPECT_NE(refusal(text).find(problem), std::string::npos) << refusal(text) << "\n" << problem;
}

}  // namespace
}  // namespace nbd
