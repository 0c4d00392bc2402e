#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/fuzz/readers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {

/// Names a reader in the names of tests.
static void PrintTo(const Reader& reader, std::ostream* out) { *out << reader.name; }

namespace {

namespace fs = std::filesystem;

class FuzzCorpus : public testing::TestWithParam<Reader> {};

TEST_P(FuzzCorpus, IsReadOrRefusedInOneLine) {
    const Reader& reader = GetParam();
    const TemporaryFolder folder;
    const fs::path copy = folder.path() / fmt::format("input{}", reader.extension);  // readers may write
    int accepted = 0, refused = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(NBD_FUZZ_CORPUS) / reader.name)) {
        SCOPED_TRACE(entry.path().filename().string());
        fs::copy_file(entry.path(), copy, fs::copy_options::overwrite_existing);
        (read_or_refuse(reader, copy) ? accepted : refused) += 1;
    }
    EXPECT_GT(accepted, 0);
    EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Readers, FuzzCorpus, testing::ValuesIn(readers().begin(), readers().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace nbd::test
