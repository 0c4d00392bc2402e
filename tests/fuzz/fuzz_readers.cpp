// The program of libFuzzer: `fuzz_readers --reader=obj corpus/obj -max_total_time=60`.
#include <fmt/core.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "tests/fuzz/readers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

const nbd::test::Reader* reader = nullptr;

/// The file that each input is written to.
const std::filesystem::path& input_file() {
    static const nbd::test::TemporaryFolder folder;
    static const std::filesystem::path file = folder.path() / fmt::format("input{}", reader->extension);
    return file;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    constexpr std::string_view option = "--reader=";
    for (int i = 1; i < *argc; ++i)
        if (const std::string_view argument = (*argv)[i]; argument.starts_with(option))
            reader = nbd::test::find_reader(argument.substr(option.size()));
    if (reader) return 0;
    fmt::print(stderr, "which reader? allowed: --reader=");
    for (const nbd::test::Reader& known : nbd::test::readers()) fmt::print(stderr, "{} ", known.name);
    fmt::print(stderr, "\n");
    std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    std::ofstream(input_file(), std::ios::binary).write(reinterpret_cast<const char*>(bytes), size);
    nbd::test::read_or_refuse(*reader, input_file());
    return 0;
}
