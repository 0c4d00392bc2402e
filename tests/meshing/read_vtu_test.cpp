#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "meshing/formats/read_tets.hpp"
#include "meshing/formats/vtu.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

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
    static std::string with(std::string text, const std::string& from, const std::string& to) {
        const auto at = text.find(from);
        EXPECT_NE(at, text.npos) << from;
        return text.replace(at, from.size(), to);
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
    const VtuBody body{&tets.T, &tets.X, &tets.X, &zero, &zero, &stress};
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
                                   with(text_body, "1 1 1.5", "1 1 2.5")));
    EXPECT_EQ(two.X.rows(), 10);
    EXPECT_EQ(two.T.row(3), Eigen::RowVector4i(6, 7, 8, 9));
}

TEST_F(ReadVtu, NamesWhatIsWrong) {
    const std::string good = whole(text_body);
    const std::vector<std::pair<std::string, std::string>> cases = {
        {with(good, "type=\"UnstructuredGrid\"", "type=\"PolyData\""),
         "holds PolyData; allowed: UnstructuredGrid"},
        {with(good, "UInt32", "UInt16"), "header_type is UInt16; allowed: UInt32, UInt64"},
        {whole(text_body, " compressor=\"vtkLZ4DataCompressor\""),
         "compressor is vtkLZ4DataCompressor; allowed: vtkZLibDataCompressor, or none"},
        {with(good, "NumberOfPoints=\"5\"", "NumberOfPoints=\"4\""), "points hold 15 numbers; allowed: 12"},
        {with(good, "NumberOfPoints=\"5\"", "NumberOfPoints=\"-5\""), "NumberOfPoints is '-5'"},
        {with(good, "4 8 11", "4 3 11"), "the offsets of cells must rise"},
        {with(good, "4 8 11", "4 8 12"), "corners of cells hold 11 numbers; allowed: 12"},
        {with(good, "10 10 5", "10 12 5"), "cell 1 is a volume of type 12 with 4 corners"},
        {with(good, "1 2 3 4 0", "1 2 3 5 0"), "cell 1 refers to point 5; allowed: 0 to 4"},
        {with(good, "Name=\"types\"", "Name=\"kinds\""), "the piece has no types of cells"},
        {with(good, "type=\"Int32\"", "type=\"Float32\""),
         "offsets of cells are of type Float32; allowed: integers"},
        {with(good, "1.5", "x"), "points hold 'x'; allowed: numbers"},
        {good.substr(0, good.size() - 12), "the file ends early, without </VTKFile>"},
        {"solid", "not a VTK file"}};
    for (const auto& [text, problem] : cases)
        EXPECT_NE(refusal(text).find(problem), std::string::npos) << refusal(text) << "\n" << problem;
}

}  // namespace
}  // namespace nbd
