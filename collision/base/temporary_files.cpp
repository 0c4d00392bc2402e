#include "collision/base/temporary_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>

#include "collision/base/message.hpp"

namespace nbd {

namespace {

/// Names that a signal handler may read at any moment: fixed memory, guarded by `state`.
struct Slot {
    enum State { free, claimed, live };
    std::atomic<int> state = free;
    std::array<char, PATH_MAX> name{};
};
std::array<Slot, 256> slots;
static_assert(std::atomic<int>::is_always_lock_free);

/// Returns -1 if all slots are taken or the name is too long; remove_temporaries() then misses this file.
int publish(const std::string& name) noexcept {
    if (name.size() >= PATH_MAX) return -1;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        int expected = Slot::free;
        if (!slots[i].state.compare_exchange_strong(expected, Slot::claimed)) continue;
        std::memcpy(slots[i].name.data(), name.c_str(), name.size() + 1);
        slots[i].state = Slot::live;
        return i;
    }
    return -1;
}

/// Names of committed files, which a signal handler may read at any moment: what was written never changes.
struct Written {
    std::mutex writing;
    std::array<char, PATH_MAX> names{};
    std::atomic<std::size_t> length = 0;
} written;

void add_written(const std::string& name) noexcept {
    const std::lock_guard lock(written.writing);
    const std::string_view separator = written.length == 0 ? "" : ", ";
    if (written.length + separator.size() + name.size() > written.names.size()) return;
    char* end = written.names.data() + written.length;
    end = std::copy(separator.begin(), separator.end(), end);
    end = std::copy(name.begin(), name.end(), end);
    written.length = end - written.names.data();
}

void withdraw(int slot) noexcept {
    if (slot >= 0) slots[slot].state = Slot::free;
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what, int error) {
    throw std::runtime_error(message(path.string(), ": ", what, ": ", std::strerror(error)));
}

constexpr std::size_t longest_name = 200;  // a file name may have 255 bytes

constexpr std::size_t longest_host = 20;

/// Name of this machine, cut off.
std::string host_name() {
    std::array<char, 256> name{};
    if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
    return std::string(name.data()).substr(0, longest_host);
}

/// Beginning of the names of temporary files for `path` and for all whose file names begin like its.
std::string beginning(const std::filesystem::path& path) {
    return message('.', path.filename().string().substr(0, longest_name));
}

std::filesystem::path temporary_name(const std::filesystem::path& path) {
    static std::atomic<unsigned> counter = 0;
    return path.parent_path() /
           message(beginning(path), '.', host_name(), '.', getpid(), '-', counter++, ".tmp");
}

/// Process of this machine that made a temporary file; 0 if another machine did, or the name is of another
/// kind.
int process_of(std::string_view name) {
    constexpr std::string_view ending = ".tmp";
    const std::size_t number =
        name.size() < ending.size() ? 0 : name.rfind('.', name.size() - ending.size() - 1);
    if (!name.ends_with(ending) || number == std::string_view::npos) return 0;
    int process = 0;
    if (std::sscanf(name.data() + number, ".%d-", &process) != 1) return 0;
    return name.substr(0, number).ends_with(message('.', host_name())) ? process : 0;
}

/// Best effort: some file systems cannot synchronise a folder, and the rename has already succeeded.
void synchronise_folder(const std::filesystem::path& folder) noexcept {
    const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    fsync(descriptor);
    close(descriptor);
}

}  // namespace

TemporaryFile::TemporaryFile(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code ignored;
    if (path_.filename().empty() || std::filesystem::is_directory(path_, ignored))
        throw std::runtime_error(
            message(path_.string(), ": is a folder; allowed: the name of a file to write"));
    do {  // a killed process with our process id may have left a file of this name
        withdraw(slot_);
        temporary_ = temporary_name(std::filesystem::absolute(path_));
        slot_ = publish(temporary_.string());
        descriptor_ = open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) {
        const int error = errno;
        withdraw(slot_);
        fail(path_, "cannot create a file in this folder", error);
    }
}

TemporaryFile::~TemporaryFile() {
    if (descriptor_ < 0) return;
    close(descriptor_);
    unlink(temporary_.c_str());
    withdraw(slot_);
}

bool TemporaryFile::write(std::span<const char> bytes) noexcept {
    while (!bytes.empty() && error_ == 0) {
        const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
        if (n >= 0)
            bytes = bytes.subspan(n);
        else if (errno != EINTR)
            error_ = errno;
    }
    return error_ == 0;
}

void TemporaryFile::commit() {
    if (descriptor_ < 0)
        throw std::logic_error(message(path_.string(), ": commit() was called twice; allowed: once"));
    if (error_ != 0) fail(path_, "cannot write", error_);
    if (fsync(descriptor_) != 0) fail(path_, "cannot write", errno);
    const std::filesystem::path target = temporary_.parent_path() / path_.filename();
    if (rename(temporary_.c_str(), target.c_str()) != 0) fail(path_, "cannot rename to this name", errno);
    close(descriptor_);
    descriptor_ = -1;
    withdraw(slot_);
    add_written(path_.native());
    synchronise_folder(temporary_.parent_path());
}

void remove_abandoned(const std::filesystem::path& path) {
    if (path.empty()) return;
    std::error_code error;
    const std::string start = beginning(path);
    std::filesystem::directory_iterator entry(std::filesystem::absolute(path).parent_path(), error), end;
    for (; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (!name.starts_with(start)) continue;
        const int process = process_of(name);
        if (process > 0 && kill(process, 0) != 0 && errno == ESRCH) unlink(entry->path().c_str());
    }
}

void remove_temporaries() noexcept {
    const int error = errno;
    for (Slot& slot : slots)
        if (slot.state == Slot::live) unlink(slot.name.data());
    errno = error;
}

std::string_view written_files() noexcept { return {written.names.data(), written.length}; }

}  // namespace nbd
