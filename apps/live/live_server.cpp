#include "apps/live/live_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <thread>

#include "apps/live/live_frames.hpp"

namespace nbd {
namespace {

constexpr const char* loopback = "127.0.0.1";
constexpr const char* plain = "text/plain; charset=utf-8";

using Clock = std::chrono::steady_clock;

void refuse(httplib::Response& response, int status, const std::string& why) {
    response.status = status;
    response.set_content(why + "\n", plain);
}

/// Sends a text as it is. set_content() would compress it as far as Brotli can, for seconds.
void send(httplib::Response& response, std::string text, const char* type) {
    const auto kept = std::make_shared<const std::string>(std::move(text));
    response.set_content_provider(kept->size(), type,
                                  [kept](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                      return sink.write(kept->data() + offset, length);
                                  });
}

/// The number of frames that a question names; empty if it names none.
std::optional<std::size_t> frame_count(const std::string& text) {
    std::size_t count = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
    if (error != std::errc() || end != text.data() + text.size() || count > 1'000'000'000)
        return std::nullopt;
    return count;
}

}  // namespace

struct LiveServer::Impl {
    httplib::Server server;
    std::thread thread;
    int port = 0;
    std::atomic<bool> has_ended = false;        // the thread
    std::atomic<int> answering = 0;             // questions whose answers are being made
    std::atomic<Clock::rep> last_question = 0;  // or its answer; 0: none

    void touch() { last_question = Clock::now().time_since_epoch().count(); }

    /// Lives while an answer is made.
    struct Answering {
        explicit Answering(Impl& server) : of(server) { ++of.answering; }
        ~Answering() {
            of.touch();
            --of.answering;
        }
        Answering(const Answering&) = delete;
        Answering& operator=(const Answering&) = delete;
        Impl& of;
    };

    void answer(LiveFrames& frames, const httplib::Request& request, httplib::Response& response) {
        const auto from = frame_count(request.get_param_value("from"));
        if (!from) return refuse(response, 400, "from: allowed: the number of frames that the page has");
        const Answering guard(*this);
        std::string text = frames.answer(request.get_param_value("run"), *from);
        if (text.empty()) return refuse(response, 410, "another run is shown here now");
        send(response, std::move(text), "application/json");
    }

    /// Refuses what is not a question to this server by its own name: a page of another site can make a
    /// browser send it elsewhere.
    httplib::Server::HandlerResponse screen(const httplib::Request& request, httplib::Response& response) {
        touch();
        const std::string host = request.get_header_value("Host");
        const bool is_ours =
            host == fmt::format("{}:{}", loopback, port) || host == fmt::format("localhost:{}", port);
        const bool is_read = request.method == "GET" || request.method == "HEAD";
        if (is_ours && is_read) return httplib::Server::HandlerResponse::Unhandled;
        if (!is_read) response.set_header("Allow", "GET, HEAD");
        if (is_ours)
            refuse(response, 405, "allowed: GET and HEAD");
        else
            refuse(response, 403, fmt::format("allowed: http://{}:{}/", loopback, port));
        return httplib::Server::HandlerResponse::Handled;
    }
};

LiveServer::LiveServer(int port) : impl_(std::make_unique<Impl>()) {
    httplib::Server& server = impl_->server;
    server.new_task_queue = [] { return new httplib::ThreadPool(4); };
    // Not SO_REUSEPORT, with which two runs would share a port.
    server.set_socket_options([](socket_t socket) {
        const int yes = 1;
        setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server.set_keep_alive_max_count(1);  // idle browsers shall not hold threads
    server.set_keep_alive_timeout(1);
    server.set_read_timeout(2);
    server.set_payload_max_length(0);
    server.set_default_headers({{"Cache-Control", "no-store"},
                                {"X-Content-Type-Options", "nosniff"},
                                {"X-Frame-Options", "DENY"},
                                {"Cross-Origin-Resource-Policy", "same-origin"}});
    errno = 0;
    impl_->port = port == 0                             ? server.bind_to_any_port(loopback)
                  : server.bind_to_port(loopback, port) ? port
                                                        : -1;
    if (impl_->port < 0)
        throw std::runtime_error(
            fmt::format("--live: port {} of {} cannot be had: {}; allowed: a port that is "
                        "free, or --live alone, which finds one",
                        port, loopback, errno == 0 ? "it is in use" : std::strerror(errno)));
}

LiveServer::~LiveServer() {
    if (!impl_->thread.joinable()) return;
    impl_->server.stop();
    impl_->thread.join();
}

void LiveServer::serve(LiveFrames& frames) {
    httplib::Server& server = impl_->server;
    server.set_pre_routing_handler(
        [this](const auto& request, auto& response) { return impl_->screen(request, response); });
    server.Get("/", [&frames](const httplib::Request&, httplib::Response& response) {
        send(response, frames.page(), "text/html; charset=utf-8");
    });
    server.Get("/frames", [this, &frames](const httplib::Request& request, httplib::Response& response) {
        impl_->answer(frames, request, response);
    });
    server.Get("/favicon.ico",
               [](const httplib::Request&, httplib::Response& response) { response.status = 204; });
    server.set_exception_handler(
        [](const httplib::Request&, httplib::Response& response, std::exception_ptr thrown) {
            try {
                std::rethrow_exception(thrown);
            } catch (const std::exception& error) {
                refuse(response, 500, error.what());
            } catch (...) {
                refuse(response, 500, "failed");
            }
        });
    // Its threads inherit that they take no signals: Ctrl-C would end accept(), and with it the server.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    impl_->thread = std::thread([this] {
        impl_->server.listen_after_bind();
        impl_->has_ended = true;
    });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    // stop() would not end a server that does not listen yet.
    while (!server.is_running() && !impl_->has_ended)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

std::string LiveServer::url() const { return fmt::format("http://{}:{}/", loopback, impl_->port); }

double LiveServer::idle_seconds() const {
    const Clock::rep last = impl_->last_question;
    if (impl_->answering > 0) return 0;
    if (last == 0) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(Clock::now() - Clock::time_point(Clock::duration(last))).count();
}

}  // namespace nbd
