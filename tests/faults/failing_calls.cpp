// A library to preload (LD_PRELOAD). It makes one call of the C library fail, or ends the process there,
// while main() runs. attack.py chooses the call:
//   NBD_FAULT_CALL    open, read, write, sync, truncate, rename, mkdir, map or allocate
//   NBD_FAULT_AT      number of the call, from 1; 0 counts them only
//   NBD_FAULT_ACTION  once: this call fails; from: this call and all after it fail; half: a write stores half
//   of its
//                     bytes, and all writes after it fail, as on a disk that becomes full; kill: SIGKILL
//                     before the call
//   NBD_FAULT_COUNT   file that gets the number of calls when main() returns
// Calls on anything but regular files and folders (pipes, terminals) are passed on and not counted, and so
// are those of `open` that do not create or change a file.
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <string_view>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

// Set before main() begins, constant while it runs.
std::string_view chosen, action;
long chosen_number = 0;

std::atomic<bool> active = false;
std::atomic<long> calls = 0;

std::string_view setting(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

/// Counts a call. Returns whether it must fail.
bool fails(std::string_view call) {
    if (!active || call != chosen) return false;
    const long number = ++calls;
    if (chosen_number == 0 || number < chosen_number) return false;
    if (action == "kill") raise(SIGKILL);
    return number == chosen_number || action != "once";
}

bool is_file(int descriptor) {
    struct stat file {};
    const int error = errno;
    const bool found = fstat(descriptor, &file) == 0 && (S_ISREG(file.st_mode) || S_ISDIR(file.st_mode));
    errno = error;
    return found;
}

bool fails(std::string_view call, int descriptor) { return is_file(descriptor) && fails(call); }

/// Whether this write is the one that stores half of its bytes.
bool is_half() { return action == "half" && calls == chosen_number; }

template <class Function>
Function next(Function, const char* name) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

/// Sets errno and returns the value by which a call reports failure.
template <class Result>
Result failed(int error, Result result) {
    errno = error;
    return result;
}

/// Where the program's own code lies.
struct Code {
    std::uintptr_t begin = 0, end = 0;
} program_code;

int find_program_code(dl_phdr_info* object, std::size_t, void*) {
    for (int i = 0; i < object->dlpi_phnum; ++i)
        if (const auto& part = object->dlpi_phdr[i]; part.p_type == PT_LOAD && (part.p_flags & PF_X) != 0)
            program_code = {object->dlpi_addr + part.p_vaddr,
                            object->dlpi_addr + part.p_vaddr + part.p_memsz};
    return 1;  // the first object is the program
}

/// Whether an allocation that returns to this place must fail.
bool fails_from(const void* place) {
    const auto address = reinterpret_cast<std::uintptr_t>(place);
    return address >= program_code.begin && address < program_code.end && fails("allocate");
}

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int run_main(int argc, char** argv, char** environment) {
    dl_iterate_phdr(find_program_code, nullptr);
    chosen = setting("NBD_FAULT_CALL");
    action = setting("NBD_FAULT_ACTION");
    chosen_number = std::atol(setting("NBD_FAULT_AT").data());
    active = true;
    const int status = real_main(argc, argv, environment);
    active = false;
    if (const char* name = std::getenv("NBD_FAULT_COUNT"))
        if (std::FILE* file = std::fopen(name, "w")) {
            std::fprintf(file, "%ld\n", calls.load());
            std::fclose(file);
        }
    return status;
}

int open_mode(int flags, va_list arguments) {
    return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, int) : 0;
}

bool changes(int flags) { return (flags & (O_CREAT | O_TRUNC | O_WRONLY | O_RDWR)) != 0; }

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(), void (*rtld_fini)(),
                      void* stack_end) {
    real_main = main;
    const auto start = next(&__libc_start_main, "__libc_start_main");
    return start(run_main, argc, argv, init, fini, rtld_fini, stack_end);
}

int open(const char* path, int flags, ...) {
    static const auto real = next(&open, "open");
    va_list arguments;
    va_start(arguments, flags);
    const int mode = open_mode(flags, arguments);
    va_end(arguments);
    if (changes(flags) && fails("open")) return failed(EMFILE, -1);
    return real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const int mode = open_mode(flags, arguments);
    va_end(arguments);
    return open(path, flags, mode);
}

std::FILE* fopen(const char* path, const char* mode) {
    static const auto real = next(&fopen, "fopen");
    if (mode[0] != 'r' && fails("open")) return failed<std::FILE*>(EMFILE, nullptr);
    return real(path, mode);
}

std::FILE* fopen64(const char* path, const char* mode) { return fopen(path, mode); }

ssize_t read(int descriptor, void* bytes, std::size_t size) {
    static const auto real = next(&read, "read");
    if (fails("read", descriptor)) return failed<ssize_t>(EIO, -1);
    return real(descriptor, bytes, size);
}

ssize_t pread(int descriptor, void* bytes, std::size_t size, off_t place) {
    static const auto real = next(&pread, "pread");
    if (fails("read", descriptor)) return failed<ssize_t>(EIO, -1);
    return real(descriptor, bytes, size, place);
}

ssize_t pread64(int descriptor, void* bytes, std::size_t size, off64_t place) {
    return pread(descriptor, bytes, size, place);
}

ssize_t write(int descriptor, const void* bytes, std::size_t size) {
    static const auto real = next(&write, "write");
    if (fails("write", descriptor)) {
        if (!is_half() || size < 2) return failed<ssize_t>(ENOSPC, -1);
        size /= 2;
    }
    return real(descriptor, bytes, size);
}

ssize_t pwrite(int descriptor, const void* bytes, std::size_t size, off_t place) {
    static const auto real = next(&pwrite, "pwrite");
    if (fails("write", descriptor)) {
        if (!is_half() || size < 2) return failed<ssize_t>(ENOSPC, -1);
        size /= 2;
    }
    return real(descriptor, bytes, size, place);
}

ssize_t pwrite64(int descriptor, const void* bytes, std::size_t size, off64_t place) {
    return pwrite(descriptor, bytes, size, place);
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
    static const auto real = next(&writev, "writev");
    if (fails("write", descriptor)) return failed<ssize_t>(ENOSPC, -1);
    return real(descriptor, parts, count);
}

int fsync(int descriptor) {
    static const auto real = next(&fsync, "fsync");
    return fails("sync", descriptor) ? failed(EIO, -1) : real(descriptor);
}

int fdatasync(int descriptor) {
    static const auto real = next(&fdatasync, "fdatasync");
    return fails("sync", descriptor) ? failed(EIO, -1) : real(descriptor);
}

int ftruncate(int descriptor, off_t size) noexcept {
    static const auto real = next(&ftruncate, "ftruncate");
    return fails("truncate", descriptor) ? failed(ENOSPC, -1) : real(descriptor, size);
}

int ftruncate64(int descriptor, off64_t size) noexcept { return ftruncate(descriptor, size); }

int rename(const char* from, const char* to) noexcept {
    static const auto real = next(&rename, "rename");
    return fails("rename") ? failed(EACCES, -1) : real(from, to);
}

int mkdir(const char* path, mode_t mode) noexcept {
    static const auto real = next(&mkdir, "mkdir");
    return fails("mkdir") ? failed(ENOSPC, -1) : real(path, mode);
}

void* mmap(void* address, std::size_t size, int protection, int flags, int descriptor, off_t place) noexcept {
    static const auto real = next(&mmap, "mmap");
    if (descriptor >= 0 && fails("map")) return failed(ENOMEM, MAP_FAILED);
    return real(address, size, protection, flags, descriptor, place);
}

void* malloc(std::size_t size) noexcept {
    return fails_from(__builtin_return_address(0)) ? failed<void*>(ENOMEM, nullptr) : __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
    return fails_from(__builtin_return_address(0)) ? failed<void*>(ENOMEM, nullptr)
                                                   : __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
    return fails_from(__builtin_return_address(0)) ? failed<void*>(ENOMEM, nullptr)
                                                   : __libc_realloc(memory, size);
}

}  // extern "C"

void* operator new(std::size_t size) {
    void* memory = fails("allocate") ? nullptr : __libc_malloc(size);
    if (!memory) throw std::bad_alloc();
    return memory;
}

void* operator new(std::size_t size, std::align_val_t alignment) {
    void* memory = fails("allocate") ? nullptr : __libc_memalign(static_cast<std::size_t>(alignment), size);
    if (!memory) throw std::bad_alloc();
    return memory;
}
#pragma GCC visibility pop
