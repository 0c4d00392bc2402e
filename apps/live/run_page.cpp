#include "apps/live/run_page.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "meshing/formats/words.hpp"

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

void wait(int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }

/// A name that no other run of this machine has.
std::string run_name() {
    return fmt::format("{:x}-{:x}", getpid(), std::chrono::system_clock::now().time_since_epoch().count());
}

}  // namespace

/// Answers the questions of pages from threads of its own.
struct RunPage::Server {
    std::optional<LiveFrames> frames;  // what it serves; must stay until it has ended
    httplib::Server server;
    std::thread thread;
    int port = 0;
    std::atomic<bool> has_ended = false;        // the thread
    std::atomic<int> answering = 0;             // questions whose answers are being made
    std::atomic<Clock::rep> last_question = 0;  // or its answer; 0: none

    void touch() { last_question = Clock::now().time_since_epoch().count(); }

    /// Lives while an answer is made.
    struct Answering {
        explicit Answering(Server& server) : of(server) { ++of.answering; }
        ~Answering() {
            of.touch();
            --of.answering;
        }
        Answering(const Answering&) = delete;
        Answering& operator=(const Answering&) = delete;
        Server& of;
    };

    void answer(const httplib::Request& request, httplib::Response& response) {
        const auto from = plain_number_in<std::uint32_t>(request.get_param_value("from"));
        if (!from) return refuse(response, 400, "from: allowed: the number of frames that the page has");
        const Answering guard(*this);
        std::string text = frames->answer(request.get_param_value("run"), *from);
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

    explicit Server(int wanted);
    ~Server();
    void serve();

    /// Seconds since the last question, or its answer; infinite before the first.
    double idle_seconds() const {
        const Clock::rep last = last_question;
        if (answering > 0) return 0;
        if (last == 0) return std::numeric_limits<double>::infinity();
        return std::chrono::duration<double>(Clock::now() - Clock::time_point(Clock::duration(last))).count();
    }
};

RunPage::Server::Server(int wanted) {
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
    port = wanted == 0                             ? server.bind_to_any_port(loopback)
           : server.bind_to_port(loopback, wanted) ? wanted
                                                   : -1;
    if (port < 0)
        throw std::runtime_error(
            fmt::format("--live: port {} of {} cannot be had: {}; allowed: a port that is "
                        "free, or --live alone, which finds one",
                        wanted, loopback, errno == 0 ? "it is in use" : std::strerror(errno)));
}

RunPage::Server::~Server() {
    if (!thread.joinable()) return;
    server.stop();
    thread.join();
}

void RunPage::Server::serve() {
    server.set_pre_routing_handler(
        [this](const auto& request, auto& response) { return screen(request, response); });
    server.Get("/", [this](const httplib::Request&, httplib::Response& response) {
        send(response, frames->page(), "text/html; charset=utf-8");
    });
    server.Get("/frames", [this](const httplib::Request& request, httplib::Response& response) {
        answer(request, response);
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
    thread = std::thread([this] {
        server.listen_after_bind();
        has_ended = true;
    });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    // stop() would not end a server that does not listen yet.
    while (!server.is_running() && !has_ended) wait(1);
}

RunPage::RunPage(int port) : server_(std::make_unique<Server>(port)) {}
RunPage::~RunPage() = default;

std::string RunPage::url() const { return fmt::format("http://{}:{}/", loopback, server_->port); }

void RunPage::begin(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                    const std::shared_ptr<const World>& world, std::string title) {
    ViewSources sources = sources_of_scene(spec, bodies, world);
    std::size_t bytes = 0;  // of a frame
    for (int b = 0; b < world->body_count(); ++b) {
        ViewSource& source = sources.bodies[b];
        source.start = world->state(b).x.cast<float>();
        source.has_forces = true;
        bytes += 6 * sizeof(float) * static_cast<std::size_t>(source.start.rows());
    }
    const int fit = std::clamp<std::size_t>(most_bytes / bytes, 2, most_frames);
    shown_ = even_frames(spec.time.frames + 1, fit);
    ViewScene scene;
    scene.title = title + from_origin(world->origin());
    scene.displacement_from = "the start";
    scene.up = up_of(spec);
    scene.recorded_frames = spec.time.frames + 1;
    scene.has_reactions = true;
    origin_ = world->origin();
    const double seconds = spec.time.dt * spec.time.frames * spec.time.steps_per_frame;
    server_->frames.emplace(std::move(sources), std::move(scene),
                            LivePage{run_name(), static_cast<int>(shown_.size()), seconds});
}

void RunPage::add(int number, const WorldSnapshot& frame, const std::vector<Nodes>& contact_forces,
                  std::span<const Reaction> reactions) {
    if (!std::ranges::binary_search(shown_, number)) return;
    LiveFrame live{.number = number, .time = frame.time};
    for (const BodyState& state : frame.bodies) live.shown.nodes.push_back(state.x.cast<float>());
    for (const Nodes& forces : contact_forces) live.shown.contact_forces.push_back(forces.cast<float>());
    for (const Reaction& one : reactions)
        if (one.by != ReactionBy::cavity)
            live.shown.reactions.push_back(
                view_reaction(one.body, one.force, one.torque, one.point, origin_));
    server_->frames->add(std::move(live));
    if (!server_->thread.joinable()) server_->serve();
}

void RunPage::end(RunState state, const std::string& message) {
    LiveFrames& frames = *server_->frames;
    frames.end(state, message);
    // An open page asks again within five seconds, and has to draw in between.
    const bool was_interrupted = interrupted();
    for (int i = 0; i < 600 && interrupted() == was_interrupted; ++i, wait(50))
        if (server_->idle_seconds() > (frames.told_end() ? 1.2 : 10)) return;
}

void RunPage::keep_serving() const {
    while (!interrupted()) wait(50);
}

}  // namespace nbd
