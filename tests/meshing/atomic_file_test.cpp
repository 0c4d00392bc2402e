#include "meshing/h5/atomic_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include "collision/base/temporary_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::h5 {
namespace {

using test::error_of;
using AtomicFileTest = test::FileTest;

TEST_F(AtomicFileTest, AppearsCompleteAtCommit) {
    const auto path = folder / "table.csv";
    AtomicFile file(path);
    file.out() << "value\n" << 0.1 << '\n' << std::string(200000, 'x');
    EXPECT_FALSE(std::filesystem::exists(path));
    file.commit();
    EXPECT_EQ(test::read_bytes(path), "value\n0.10000000000000001\n" + std::string(200000, 'x'));
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFileTest, KeepsTheOldFileAndLeavesNoTemporaryWithoutCommit) {
    const auto path = folder / "table.csv";
    test::write_bytes(path, "old");
    {
        AtomicFile file(path);
        file.out() << "new" << std::flush;
        EXPECT_EQ(files_in_folder(), 2u);
    }
    EXPECT_EQ(test::read_bytes(path), "old");
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFileTest, TwoWritersOfOneNameBothSucceed) {
    const auto path = folder / "table.csv";
    AtomicFile a(path), b(path);
    a.out() << std::string(100000, 'a');
    b.out() << std::string(70000, 'b');
    b.commit();
    EXPECT_EQ(test::read_bytes(path), std::string(70000, 'b'));
    a.commit();
    EXPECT_EQ(test::read_bytes(path), std::string(100000, 'a'));
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFileTest, AcceptsNamesAsLongAsTheFileSystemAllows) {
    const auto path = folder / std::string(255, 'n');
    AtomicFile file(path);
    file.commit();
    EXPECT_TRUE(std::filesystem::exists(path));
}

TEST_F(AtomicFileTest, ReportsWhereItCannotWrite) {
    EXPECT_EQ(error_of([&] { AtomicFile(folder / "none" / "a.csv"); }),
              (folder / "none" / "a.csv").string() +
                  ": cannot create a file in this folder: No such file or directory");
    test::write_bytes(folder / "file", "");
    EXPECT_EQ(
        error_of([&] { AtomicFile(folder / "file" / "a.csv"); }),
        (folder / "file" / "a.csv").string() + ": cannot create a file in this folder: Not a directory");
    EXPECT_EQ(error_of([&] { AtomicFile{folder}; }),
              folder.string() + ": is a folder; allowed: the name of a file to write");
}

/// While it lives, root acts as a user without rights; another user stays who he is.
class WithoutRights {
 public:
    WithoutRights() {
        if (geteuid() == 0 && seteuid(nobody) != 0)
            throw std::runtime_error("root cannot become another user");
    }
    ~WithoutRights() {
        if (getuid() == 0 && seteuid(0) != 0) std::abort();
    }
    WithoutRights(const WithoutRights&) = delete;
    WithoutRights& operator=(const WithoutRights&) = delete;

 private:
    static constexpr uid_t nobody = 65534;
};

TEST_F(AtomicFileTest, RejectsAReadOnlyFolder) {
    using enum std::filesystem::perms;
    std::filesystem::permissions(folder, owner_read | owner_exec | others_read | others_exec);
    {
        const WithoutRights guard;
        EXPECT_EQ(error_of([&] { AtomicFile(folder / "a.csv"); }),
                  (folder / "a.csv").string() + ": cannot create a file in this folder: Permission denied");
    }
    std::filesystem::permissions(folder, owner_all);
}

TEST_F(AtomicFileTest, ReportsAFailedWrite) {
    const auto path = folder / "big.csv";
    const int status = test::in_child([&] {
        test::limit_file_size(100000);
        const std::string error = error_of([&] {
            AtomicFile file(path);
            file.out() << std::string(300000, 'x');
            file.commit();
        });
        if (error != path.string() + ": cannot write: File too large") _exit(1);
    });
    EXPECT_EQ(status, 0);
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(AtomicFileTest, IsRemovedByASignalHandler) {
    const int status = test::in_child([&] {
        std::signal(SIGINT, [](int) {
            remove_temporaries();
            _exit(7);
        });
        AtomicFile a(folder / "a.csv"), b(folder / "b.csv"), done(folder / "done.csv");
        done.commit();
        std::raise(SIGINT);
    });
    EXPECT_EQ(status, 7);
    EXPECT_EQ(files_in_folder(), 1u);
    EXPECT_TRUE(std::filesystem::exists(folder / "done.csv"));
}

}  // namespace
}  // namespace nbd::h5
