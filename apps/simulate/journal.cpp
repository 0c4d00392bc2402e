#include "apps/simulate/journal.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <stdexcept>

#include "meshing/h5/sha256.hpp"

namespace nbd {
namespace {

constexpr std::string_view magic = "nbdtree journal 12\n";

/// Header of every record.
struct RecordHead {
    std::uint64_t size = 0;
    char sha256[64] = {};  // hex, of the record
};

RecordHead head_of(std::string_view record) {
    RecordHead head;
    head.size = record.size();
    h5::Sha256 hash;
    hash.add(std::as_bytes(std::span(record)));
    const std::string hex = hash.hex();
    std::memcpy(head.sha256, hex.data(), sizeof(head.sha256));
    return head;
}

std::string framed(std::string_view record) {
    const RecordHead head = head_of(record);
    std::string bytes(sizeof(head), '\0');
    std::memcpy(bytes.data(), &head, sizeof(head));
    return bytes.append(record);
}

/// Reads up to `size` bytes, fewer at the end of the file.
std::string read_at(int descriptor, std::uint64_t position, std::uint64_t size) {
    std::string bytes(size, '\0');
    std::size_t got = 0;
    while (got < bytes.size()) {
        const ssize_t n = pread(descriptor, bytes.data() + got, bytes.size() - got, position + got);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        got += n;
    }
    bytes.resize(got);
    return bytes;
}

std::string to_text(const Journal::Facts& facts) {
    std::string text;
    for (const auto& [name, value] : facts) text += name + '\n' + value + '\n';
    return text;
}

/// Name of the first fact that differs; empty if none does.
std::string first_difference(std::string_view stored, const Journal::Facts& facts) {
    for (const auto& [name, value] : facts) {
        const std::string expected = name + '\n' + value + '\n';
        if (!stored.starts_with(expected)) return name;
        stored.remove_prefix(expected.size());
    }
    return stored.empty() ? "" : std::string(stored.substr(0, stored.find('\n')));
}

}  // namespace

void Journal::fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {}", path_.string(), what));
}

/// Opens and locks the file. Starts over if its owner removed it in between.
void Journal::lock() {
    for (;;) {
        descriptor_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (descriptor_ < 0) fail(fmt::format("cannot be opened: {}", std::strerror(errno)));
        // File systems without locks, as on some clusters, must not prevent a run.
        if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            close(std::exchange(descriptor_, -1));
            fail("another run is writing this output");
        }
        struct stat ours = {}, there = {};
        if (fstat(descriptor_, &ours) == 0 && stat(path_.c_str(), &there) == 0 &&
            ours.st_ino == there.st_ino && ours.st_dev == there.st_dev)
            return;
        close(std::exchange(descriptor_, -1));
    }
}

Journal::Journal(std::filesystem::path path, const Facts& facts, bool resume) : path_(std::move(path)) {
    lock();
    try {
        const std::string start = read_at(descriptor_, 0, magic.size());
        if (!magic.starts_with(start)) {
            if (start.starts_with("nbdtree journal "))
                fail("was written by another version of nbdtree; remove it to start over");
            fail("is not a journal of nbdtree; remove it or choose another output");
        }
        position_ = magic.size();
        const std::optional<std::string> stored = start == magic ? read_record() : std::nullopt;
        const std::uint64_t first = position_;
        if (!stored || !read_record()) {  // new, or its run was killed while starting
            position_ = 0;
            if (ftruncate(descriptor_, 0) != 0) fail(std::strerror(errno));
            write_at_end(std::string(magic) + framed(to_text(facts)));
            return;
        }
        position_ = first;
        if (!resume)
            fail("holds an unfinished run; continue it with --resume, or remove the file to start over");
        if (const std::string other = first_difference(*stored, facts); !other.empty())
            fail(fmt::format("its run was started with another {}; remove the file to start over", other));
    } catch (...) {
        close(std::exchange(descriptor_, -1));
        throw;
    }
}

Journal::~Journal() {
    if (descriptor_ < 0) return;
    if (records_ == 0 && !read_record()) unlink(path_.c_str());
    close(descriptor_);
}

std::optional<std::string> Journal::read_record() {
    RecordHead head;
    const std::string head_bytes = read_at(descriptor_, position_, sizeof(head));
    if (head_bytes.size() < sizeof(head)) return std::nullopt;
    std::memcpy(&head, head_bytes.data(), sizeof(head));
    struct stat file {};
    if (fstat(descriptor_, &file) != 0) return std::nullopt;
    const std::uint64_t left = static_cast<std::uint64_t>(file.st_size) - position_ - sizeof(head);
    if (head.size > left) return std::nullopt;
    std::string record = read_at(descriptor_, position_ + sizeof(head), head.size);
    const RecordHead found = head_of(record);
    if (found.size != head.size || std::memcmp(found.sha256, head.sha256, sizeof(head.sha256)) != 0)
        return std::nullopt;
    position_ += sizeof(head) + head.size;
    return record;
}

std::optional<std::string> Journal::next() {
    std::optional<std::string> record = read_record();
    if (record)
        ++records_;
    else if (ftruncate(descriptor_, position_) != 0)
        fail(fmt::format("cannot truncate it after the last complete record: {}", std::strerror(errno)));
    return record;
}

void Journal::append(std::string_view record) {
    write_at_end(framed(record));
    ++records_;
}

void Journal::write_at_end(std::string_view bytes) {
    std::uint64_t end = position_;
    while (!bytes.empty()) {
        const ssize_t n = pwrite(descriptor_, bytes.data(), bytes.size(), end);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail(fmt::format("cannot write: {}", std::strerror(errno)));
        bytes.remove_prefix(n);
        end += n;
    }
    if (fdatasync(descriptor_) != 0) fail(fmt::format("cannot write: {}", std::strerror(errno)));
    position_ = end;
}

void Journal::remove() {
    if (unlink(path_.c_str()) != 0) fail(fmt::format("cannot be removed: {}", std::strerror(errno)));
    close(std::exchange(descriptor_, -1));
}

}  // namespace nbd
