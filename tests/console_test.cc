// relmap-console between a browser and a daemon: what it passes on, whom it lets in, and how it starts and fails.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/channel.h"
#include "proto/access/credentials.h"
#include "proto/base/base64.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/generic_calls.h"
#include "tests/support/http_get.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/skeleton_city.h"
#include "tools/console/forward/grpc_web.h"
#include "tools/console/http/testing/raw_browser.h"
#include "tools/console/layout/testing/decode_tile.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using console::testing::Answer;
using console::testing::RawBrowser;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kSessions = 4, kFrames = 250;

bool eventually(const std::function<bool()>& done) {
  for (const auto until = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < until;
       std::this_thread::sleep_for(std::chrono::milliseconds(20)))
    if (done()) return true;
  return done();
}

// A console that runs as a process, and what a browser or script says to it over HTTP without TLS.
class RunningConsole {
 public:
  // `listen`: empty: without --listen.
  RunningConsole(const std::string& folder, std::vector<std::string> arguments,
                 const std::string& listen = "127.0.0.1:0", std::vector<std::string> environment = {})
      : out_(folder + "/out"), err_(folder + "/err") {
    fs::create_directories(folder);
    arguments.insert(arguments.begin(), built_program("relmap-console"));
    if (!listen.empty()) arguments.insert(arguments.end(), {"--listen", listen});
    arguments.insert(arguments.end(), {"--cache", folder + "/cache"});
    fs::remove(out_);
    process_ = std::make_unique<Process>(
        arguments, ProcessOptions{.standard_output = out_, .standard_error = err_, .environment = environment});
    const bool told = eventually([&] { return read_text(out_).ends_with('\n') || !process_->running(); });
    address_ = read_text(out_);
    if (!told || address_.empty()) throw std::runtime_error("relmap-console does not serve: " + read_text(err_));
    address_.pop_back();
    const std::size_t slash = address_.find('/', address_.find("://") + 3);
    const std::size_t colon = address_.rfind(':', slash);
    host_ = address_.substr(address_.find("://") + 3, slash - address_.find("://") - 3);
    port_ = static_cast<std::uint16_t>(std::stoul(address_.substr(colon + 1, slash - colon - 1)));
    if (const std::size_t at = address_.find("#key="); at != std::string::npos) key_ = address_.substr(at + 5);
  }

  Process& process() { return *process_; }
  const std::string& address() const { return address_; }
  const std::string& key() const { return key_; }
  std::uint16_t port() const { return port_; }
  std::string log() const { return read_text(err_); }

  std::string request(const std::string& method, const std::string& path, const std::string& headers,
                      const std::string& body = "") const {
    return method + " " + path + " HTTP/1.1\r\nHost: " + host_ + "\r\nOrigin: http://" + host_ + "\r\n" + headers +
           (method == "POST" ? "Content-Length: " + std::to_string(body.size()) + "\r\n" : "") + "\r\n" + body;
  }
  Answer get(const std::string& path, const std::string& headers = "") const {
    return RawBrowser(port_).send(request("GET", path, headers)).answer();
  }
  Answer post(const std::string& path, const std::string& body, const std::string& headers = "") const {
    return RawBrowser(port_).send(request("POST", path, headers, body)).answer();
  }
  // The header by which a browser that has logged in shows itself.
  std::string log_in(const std::string& token) const {
    const Answer answer = post("/login", json{{"token", token}}.dump());
    EXPECT_EQ(answer.status, 204) << answer.body;
    if (!answer.headers.contains("set-cookie")) return "";
    const std::string set = answer.headers.at("set-cookie");
    return "Cookie: " + set.substr(0, set.find(';')) + "\r\n";
  }
  std::string log_in() const { return log_in(key_); }

  static std::string web_headers(const std::string& more) {
    return "Content-Type: application/grpc-web+proto\r\n" + more;
  }
  struct Forwarded {
    int http = 0;
    std::vector<std::string> messages;
    console::CallEnd end{-1};  // details in base64
  };
  Forwarded call(const std::string& method, const std::string& message, const std::string& headers) const {
    const Answer answer = post(method, console::message_frame(message), web_headers(headers));
    Forwarded forwarded;
    forwarded.http = answer.status;
    const auto frames = console::frames_of(answer.body);
    if (answer.status != 200 || !frames.ok()) return forwarded;
    for (const console::Frame& frame : *frames)
      if (frame.trailers)
        forwarded.end = console::read_trailers(frame.bytes).or_throw();
      else
        forwarded.messages.emplace_back(frame.bytes);
    return forwarded;
  }

 private:
  const std::string out_, err_;
  std::unique_ptr<Process> process_;
  std::string address_, host_, key_;
  std::uint16_t port_ = 0;
};

constexpr char kGetStatus[] = "/relmap.v1.Map/GetStatus", kSetLabel[] = "/relmap.v1.Map/SetLabel",
               kWatchMap[] = "/relmap.v1.Map/WatchMap", kGetFrame[] = "/relmap.v1.Map/GetFrame";

std::string bearer(const std::string& token) { return "Authorization: Bearer " + token + "\r\n"; }

class ConsoleTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    city_ = std::make_unique<storage::TemporaryFolder>();
    SkeletonCity city;
    city.frames = kSessions * kFrames;
    city.frames_per_session = kFrames;
    city.streets = 4;
    build_city_folder(city, *city_ / "map");
  }
  static void TearDownTestSuite() { city_.reset(); }

  void SetUp() override { fs::copy(*city_ / "map", folder_ / "map", fs::copy_options::recursive); }

  DaemonOptions served() const { return {.data = folder_ / "map", .lcm = "", .more = {"--http", "127.0.0.1:0"}}; }
  DaemonOptions with_credentials() const {
    DaemonOptions options = served();
    options.credentials = folder_ / "fleet";
    return options;
  }
  // A folder that says where the daemon answers, as its own does, but for what `without` says.
  std::string told_folder(const std::string& without) const {
    const std::string folder = folder_ / "told";
    fs::create_directories(folder);
    std::string told;
    std::istringstream lines(read_text(folder_ / "map/endpoint"));
    for (std::string line; std::getline(lines, line);)
      if (without.empty() || !line.starts_with(without + " ")) told += line + "\n";
    std::ofstream(folder + "/new") << told;
    fs::rename(folder + "/new", folder + "/endpoint");
    return folder;
  }
  std::string console_folder() const { return folder_ / "console"; }

  static Finished admin(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), built_program("relmap-admin"));
    return run_program(arguments);
  }
  void make_authority() {
    const Finished made = admin({"credentials", "ca", folder_ / "fleet", "--host", "127.0.0.1", "--host", "localhost"});
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
  }
  std::string new_token(const std::string& name, const std::string& role) {
    const std::string file = folder_ / (name + ".pem");
    const Finished made =
        admin({"credentials", "new", folder_ / "fleet", name, "--role", role, "--token", "--out", file});
    EXPECT_EQ(made.exit_code, 0) << made.standard_error;
    return access::read_credentials(file).or_throw().token;
  }
  void revoke(const std::string& name) {
    const Finished done = admin({"credentials", "revoke", folder_ / "fleet", name});
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  }
  std::vector<std::string> authority() const { return {"--credentials", folder_ / "fleet/ca.crt"}; }
  std::vector<std::string> to(const std::string& server, bool tls) const {
    std::vector<std::string> arguments{server};
    const std::vector<std::string> more = tls ? authority() : std::vector<std::string>();
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  // The daemon's figure of this name.
  static double metric(const RunningDaemon& daemon, const std::string& name) {
    return samples_of(http_get(daemon.http(), "/metrics").body)[name];
  }

  static std::string label(const std::string& text) {
    v1::SetLabelRequest request;
    *request.mutable_frame() = to_wire(FrameId{1, 5});
    request.set_label(text);
    return request.SerializeAsString();
  }

  // The program's end, when it is started with these arguments.
  Finished start(std::vector<std::string> arguments, const std::vector<std::string>& environment = {}) const {
    arguments.insert(arguments.begin(), built_program("relmap-console"));
    arguments.insert(arguments.end(), {"--cache", folder_ / "cache"});
    return run_program(arguments, kPatience, environment);
  }

  static std::unique_ptr<storage::TemporaryFolder> city_;
  const storage::TemporaryFolder folder_;
};
std::unique_ptr<storage::TemporaryFolder> ConsoleTest::city_;

TEST_F(ConsoleTest, PassesAnswersOnByteForByte) {
  RunningDaemon daemon(served());
  RunningConsole console(console_folder(), {folder_ / "map"});
  const std::string me = console.log_in();
  const auto channel =
      client::open_channel(client::resolve_server(folder_ / "map").or_throw(), "", client::usual_channel_arguments())
          .or_throw();
  v1::GetFrameRequest frame;
  *frame.mutable_frame() = to_wire(FrameId{1, 5});
  v1::GetNeighbourhoodRequest around;
  *around.mutable_root() = to_wire(FrameId{2, 100});
  v1::ListEdgesRequest edges;
  edges.set_page_size(5000);
  v1::GetSkeletonRequest skeleton;
  skeleton.set_level(3);
  skeleton.set_candidates(true);
  const std::pair<std::string, std::string> calls[] = {
      {"/relmap.v1.Map/ListSessions", ""},
      {kGetFrame, frame.SerializeAsString()},
      {"/relmap.v1.Map/GetNeighbourhood", around.SerializeAsString()},
      {"/relmap.v1.Map/GetClosureMatrix", ""},
      {"/relmap.v1.Map/ListEdges", edges.SerializeAsString()},
      {"/relmap.v1.Map/GetSkeleton", skeleton.SerializeAsString()},
      {"/grpc.health.v1.Health/Check", ""},
  };
  for (const auto& [method, request] : calls) {
    const GenericReplies direct = call_generic(channel, method, {request}, 10'000);
    ASSERT_TRUE(direct.status.ok()) << method << ": " << direct.status.error_message();
    const auto forwarded = console.call(method, request, me);
    EXPECT_EQ(forwarded.http, 200) << method;
    EXPECT_EQ(forwarded.end.code, 0) << method << ": " << forwarded.end.message;
    EXPECT_TRUE(forwarded.messages == direct.messages)
        << method << ": " << forwarded.messages.size() << " and " << direct.messages.size() << " messages";
    EXPECT_FALSE(forwarded.messages.empty()) << method;
  }
  // What is the same of an answer that is another at any time.
  v1::GetStatusReply direct, forwarded;
  ASSERT_TRUE(direct.ParseFromString(call_generic(channel, kGetStatus, {""}, 2).messages.at(0)));
  ASSERT_TRUE(forwarded.ParseFromString(console.call(kGetStatus, "", me).messages.at(0)));
  EXPECT_EQ(forwarded.boot_id(), direct.boot_id());
  EXPECT_EQ(forwarded.caller_name(), direct.caller_name());
  EXPECT_EQ(forwarded.caller_role(), "operator");
}

TEST_F(ConsoleTest, PassesRefusalsOnWithTheirDetails) {
  RunningDaemon daemon(served());
  RunningConsole console(console_folder(), {folder_ / "map"});
  const std::string me = console.log_in();
  v1::GetFrameRequest request;
  *request.mutable_frame() = to_wire(FrameId{99, 1});
  const auto stub = v1::Map::NewStub(
      client::open_channel(client::resolve_server(folder_ / "map").or_throw(), "", client::usual_channel_arguments())
          .or_throw());
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "one");
  v1::GetFrameReply reply;
  const grpc::Status direct = stub->GetFrame(&context, request, &reply);
  ASSERT_FALSE(direct.ok());
  const auto forwarded = console.call(kGetFrame, request.SerializeAsString(), me + "x-request-id: one\r\n");
  EXPECT_EQ(forwarded.http, 200);
  EXPECT_TRUE(forwarded.messages.empty());
  EXPECT_EQ(forwarded.end.code, direct.error_code());
  EXPECT_EQ(forwarded.end.message, direct.error_message());
  std::string details = base64(direct.error_details());
  details.erase(std::min(details.size(), details.find('=')));
  EXPECT_FALSE(details.empty());
  EXPECT_EQ(forwarded.end.details.substr(0, forwarded.end.details.find('=')), details);

  const auto unknown = console.call("/relmap.v1.Map/NoSuchCall", "", me);
  EXPECT_EQ(unknown.end.code, static_cast<int>(grpc::StatusCode::UNIMPLEMENTED));
  EXPECT_EQ(console.call("/relmap.v1.Ingest/../../etc", "", me).http, 404);
  EXPECT_EQ(console.call(kGetStatus, "", "").http, 401);
}

TEST_F(ConsoleTest, EndsCallsAtTheirDeadlineAndWhenTheBrowserGoes) {
  RunningDaemon daemon(served());
  RunningConsole console(console_folder(), {folder_ / "map"});
  const std::string me = console.log_in();
  const std::string running = "relmap_rpc_running{kind=\"watch\"}";
  v1::WatchMapRequest request;
  request.set_from(v1::WATCH_FROM_NOW);
  const std::string watch = request.SerializeAsString();
  EXPECT_EQ(console.call(kWatchMap, watch, me + "grpc-timeout: 300m\r\n").end.code,
            static_cast<int>(grpc::StatusCode::DEADLINE_EXCEEDED));
  EXPECT_TRUE(eventually([&] { return metric(daemon, running) == 0; }));
  {
    RawBrowser browser(console.port());
    browser.send(console.request("POST", kWatchMap, RunningConsole::web_headers(me), console::message_frame(watch)));
    EXPECT_EQ(browser.head().status, 200);
    EXPECT_TRUE(eventually([&] { return metric(daemon, running) == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return metric(daemon, running) == 0; })) << "though nothing happened to the map";
}

TEST_F(ConsoleTest, GivesEachCallerHisOwnRights) {
  make_authority();
  const std::string anna = new_token("anna", "operator"), dash = new_token("dash", "reader");
  RunningDaemon daemon(with_credentials());
  RunningConsole console(console_folder(), to(daemon.address(), true));
  EXPECT_EQ(json::parse(console.get("/about").body)["login"], "token");
  const std::string as_anna = console.log_in(anna), as_dash = console.log_in(dash);
  for (const std::string& shown : {as_anna, as_dash}) {
    EXPECT_EQ(shown.find(anna), std::string::npos) << "the cookie goes to every server of the host";
    EXPECT_EQ(shown.find(dash), std::string::npos) << "the cookie goes to every server of the host";
  }
  // Both at once, again and again, and without a session as well.
  std::vector<std::thread> callers;
  for (const auto& [shown, name, may] :
       {std::tuple(as_anna, "anna", true), std::tuple(as_dash, "dash", false), std::tuple(bearer(anna), "anna", true),
        std::tuple(bearer(dash), "dash", false)})
    callers.emplace_back([&console, shown = shown, name = std::string(name), may = may] {
      for (int i = 0; i < 20; ++i) {
        const auto set = console.call(kSetLabel, label(name + std::to_string(i)), shown);
        EXPECT_EQ(set.end.code, static_cast<int>(may ? grpc::StatusCode::OK : grpc::StatusCode::PERMISSION_DENIED))
            << name << ": " << set.http << " " << set.end.message;
        v1::GetStatusReply status;
        const auto asked = console.call(kGetStatus, "", shown);
        ASSERT_EQ(asked.messages.size(), 1u);
        ASSERT_TRUE(status.ParseFromString(asked.messages[0]));
        EXPECT_EQ(status.caller_name(), name);
      }
    });
  for (std::thread& caller : callers) caller.join();

  // What the daemon tells operators only, the console does.
  const auto sample = [&](const std::string& shown) {
    json newest;
    EXPECT_TRUE(eventually([&] {
      const json told = json::parse(console.get("/health/samples", shown).body);
      for (const json& each : told["samples"])
        if (each["reachable"] == true) newest = each;
      return !newest.is_null();
    }));
    return newest;
  };
  EXPECT_TRUE(sample(as_anna).contains("disk_bytes"));
  EXPECT_FALSE(sample(as_dash).contains("disk_bytes"));
  EXPECT_FALSE(sample(bearer(dash)).contains("disk_bytes"));
}

TEST_F(ConsoleTest, ARevokedTokenIsUsedNoMoreAndItsOwnerLogsInAgain) {
  make_authority();
  const std::string anna = new_token("anna", "operator"), bert = new_token("bert", "reader");
  RunningDaemon daemon(with_credentials());
  RunningConsole console(console_folder(), to(daemon.address(), true));
  const auto state = [&](const std::string& shown) { return json::parse(console.get("/map/layout", shown).body); };
  const std::string as_bert = console.log_in(bert), as_anna = console.log_in(anna);
  EXPECT_TRUE(eventually([&] { return state(as_anna)["version"] != 0; }));
  revoke("anna");
  // By a call that is forwarded the console learns it, and from then on shows nothing of its own either.
  EXPECT_TRUE(eventually([&] { return console.call(kGetStatus, "", as_anna).http == 401; }));
  EXPECT_EQ(console.get("/map/layout", as_anna).status, 401);
  EXPECT_EQ(console.get("/map/layout", bearer(anna)).status, 401);
  for (int i = 0; i < 30; ++i) {
    EXPECT_EQ(console.call(kGetStatus, "", as_anna).http, 401) << "and not 429";
    EXPECT_EQ(console.call(kGetStatus, "", bearer(anna)).http, 401) << "and not 429";
  }
  const std::string anew = new_token("anna2", "operator");
  EXPECT_TRUE(eventually([&] { return console.post("/login", json{{"token", anew}}.dump()).status == 204; }));
  // The console itself goes on with the token of somebody else.
  EXPECT_TRUE(eventually([&] { return state(as_bert)["error"].is_null(); })) << state(as_bert).dump();

  EXPECT_EQ(console.post("/logout", "", as_bert).status, 204);
  EXPECT_EQ(console.call(kGetStatus, "", as_bert).http, 401);
  for (int i = 0; i < 11; ++i) console.call(kGetStatus, "", bearer("wrong" + std::to_string(i)));
  EXPECT_EQ(console.call(kGetStatus, "", bearer("wrong")).http, 429);
}

TEST_F(ConsoleTest, FindsARestartedDaemonAgainAndShowsWhatItHasMeanwhile) {
  make_authority();
  const std::string dash = new_token("dash", "reader");
  auto daemon = std::make_unique<RunningDaemon>(with_credentials());
  RunningConsole by_token(folder_ / "by-token", to(told_folder("socket"), true));
  RunningConsole by_key(folder_ / "by-key", {folder_ / "map"});
  const std::string as_dash = by_token.log_in(dash), as_local = by_key.log_in();
  for (const auto& [console, shown] : {std::pair(&by_token, as_dash), std::pair(&by_key, as_local)})
    EXPECT_TRUE(eventually([&] { return json::parse(console->get("/map/layout", shown).body)["version"] != 0; }));
  daemon->process().kill();
  const auto away = [&](const RunningConsole& console, const std::string& shown) {
    return eventually([&] {
      const Answer answer = console.get("/map/layout", shown);
      EXPECT_EQ(answer.status, 200) << answer.body;
      return answer.status != 200 || !json::parse(answer.body)["error"].is_null();
    });
  };
  EXPECT_TRUE(away(by_token, as_dash));
  EXPECT_TRUE(away(by_key, as_local));
  EXPECT_EQ(by_token.call(kGetStatus, "", as_dash).end.code, static_cast<int>(grpc::StatusCode::UNAVAILABLE));
  // Longer than a caller is not asked about again.
  std::this_thread::sleep_for(std::chrono::seconds(16));
  const json state = json::parse(by_token.get("/map/layout", as_dash).body);
  EXPECT_EQ(by_token.get("/map/tiles/" + state["version"].dump() + "/0/0/0", as_dash).status, 200);
  EXPECT_NE(by_token.get("/map/layout", bearer("wrong")).status, 200);

  daemon = std::make_unique<RunningDaemon>(with_credentials());  // at another port
  told_folder("socket");
  EXPECT_TRUE(eventually([&] { return by_token.call(kGetStatus, "", as_dash).end.code == 0; }));
  EXPECT_TRUE(eventually([&] { return by_key.call(kGetStatus, "", as_local).end.code == 0; }));
}

TEST_F(ConsoleTest, DoesNotGoOnWithADaemonWhoseAddressBecameOfAnotherKind) {
  // Whoever comes by TCP without TLS is let in by this daemon; by its socket, by the console's key.
  auto daemon = std::make_unique<RunningDaemon>(served());
  RunningConsole console(console_folder(), {told_folder("socket")});
  EXPECT_EQ(json::parse(console.get("/about").body)["login"], "none");
  EXPECT_EQ(console.call(kGetStatus, "", "").end.code, 0);
  daemon->process().kill();
  daemon = std::make_unique<RunningDaemon>(served());
  ASSERT_THAT(read_text(told_folder("") + "/endpoint"), HasSubstr("socket "));
  // It answers at another port now, and at the old one nobody does.
  EXPECT_TRUE(eventually([&] { return console.call(kGetStatus, "", "").http != 200; }));
  const Answer refused = console.post(kGetStatus, console::message_frame(""), RunningConsole::web_headers(""));
  EXPECT_THAT(refused.body, AllOf(HasSubstr("NEEDS_RESTART"), HasSubstr("start the console again")));
  // Nor does it follow the map by the socket for everyone.
  EXPECT_TRUE(eventually([&] {
    const json error = json::parse(console.get("/map/layout").body)["error"];
    return !error.is_null() && error["reason"] == "NEEDS_RESTART";
  }));
}

TEST_F(ConsoleTest, ServesALayoutWhoseTilesDecode) {
  RunningDaemon daemon(served());
  RunningConsole console(console_folder(), {folder_ / "map"});
  EXPECT_EQ(console.get("/map/layout").status, 401);
  const std::string me = console.log_in();
  json state;
  EXPECT_TRUE(eventually([&] {
    state = json::parse(console.get("/map/layout", me).body);
    return state["version"] != 0 && state["coarse"] == false;
  }));
  EXPECT_EQ(state["frames"], kSessions * kFrames);
  const Answer answer = console.get("/map/tiles/" + state["version"].dump() + "/0/0/0", me);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.headers.at("content-type"), "application/vnd.relmap.tile");
  const auto tile = console::testing::decode_tile(answer.body);
  ASSERT_TRUE(tile);
  EXPECT_FALSE(tile->vertices.empty());
  EXPECT_EQ(console.get("/map/tiles/7/0/0/0", me).status, 404);
  EXPECT_EQ(console.get("/", "").status, 200);
}

// An answer over TLS by a server whose certificate this authority has issued for this name, or why there is none.
std::string over_tls(std::uint16_t port, const std::string& authority, const std::string& name,
                     const std::string& request) {
  namespace asio = boost::asio;
  asio::io_context io;
  asio::ssl::context context(asio::ssl::context::tls_client);
  context.load_verify_file(authority);
  context.set_verify_mode(asio::ssl::verify_peer);
  asio::ssl::stream<asio::ip::tcp::socket> stream(io, context);
  SSL_set1_host(stream.native_handle(), name.c_str());
  std::string answer;
  boost::system::error_code error;
  stream.next_layer().connect({asio::ip::address_v4::loopback(), port});
  (void)stream.handshake(asio::ssl::stream_base::client, error);
  if (error) return error.message();
  asio::write(stream, asio::buffer(request));
  char bytes[4096];
  while (answer.find("\r\n\r\n") == std::string::npos) {
    const std::size_t got = stream.read_some(asio::buffer(bytes), error);
    if (error) return answer + error.message();
    answer.append(bytes, got);
  }
  return answer;
}

TEST_F(ConsoleTest, SpeaksTlsWithTheDaemonAndWithBrowsers) {
  make_authority();
  const std::string anna = new_token("anna", "operator");
  RunningDaemon daemon(with_credentials());
  std::vector<std::string> arguments = to(daemon.address(), true);
  arguments.insert(arguments.end(), {"--tls-certificate", folder_ / "fleet/server.pem"});
  RunningConsole console(console_folder(), arguments);
  EXPECT_TRUE(console.address().starts_with("https://127.0.0.1:")) << console.address();
  const std::string body = json{{"token", anna}}.dump();
  std::string request = console.request("POST", "/login", "", body);
  request.replace(request.find("Origin: http:"), 13, "Origin: https:");
  const std::string answer = over_tls(console.port(), folder_ / "fleet/ca.crt", "localhost", request);
  EXPECT_THAT(answer, AllOf(HasSubstr("HTTP/1.1 204"), HasSubstr("HttpOnly; SameSite=Strict; Secure"),
                            HasSubstr("Strict-Transport-Security"), Not(HasSubstr(anna))));
  EXPECT_THAT(over_tls(console.port(), folder_ / "fleet/ca.crt", "another.example", request),
              HasSubstr("certificate verify failed"));
  EXPECT_EQ(console.get("/").status, 0) << "not without TLS";

  // A daemon whose certificate somebody else has issued gets no token.
  const Finished other = admin({"credentials", "ca", folder_ / "other", "--host", "127.0.0.1"});
  ASSERT_EQ(other.exit_code, 0) << other.standard_error;
  RunningConsole fooled(folder_ / "fooled", {daemon.address(), "--credentials", folder_ / "other/ca.crt"});
  EXPECT_EQ(fooled.post("/login", body).status, 502);
}

TEST_F(ConsoleTest, StartsAtAFreePortAndAgainAfterItsEnd) {
  RunningDaemon daemon(served());
  RunningConsole first(folder_ / "first", {folder_ / "map"}, ""), second(folder_ / "second", {folder_ / "map"}, "");
  EXPECT_NE(first.port(), second.port());
  EXPECT_THAT(second.log(), HasSubstr("is taken: using " + std::to_string(second.port())));
  EXPECT_EQ(first.get("/about").status, 200);
  EXPECT_EQ(second.get("/about").status, 200);
  const std::string taken = "127.0.0.1:" + std::to_string(first.port());
  const Finished refused = start({folder_ / "map", "--listen", taken});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_TRUE(refused.standard_error.starts_with("PORT_IN_USE: ")) << refused.standard_error;
  first.process().signal(SIGTERM);
  EXPECT_EQ(first.process().wait(kPatience), 0);
  RunningConsole again(folder_ / "again", {folder_ / "map"}, taken);
  EXPECT_EQ(again.get("/about").status, 200);
  EXPECT_NE(again.key(), first.key());
}

TEST_F(ConsoleTest, EndsWithTheReasonWhenItCannotStart) {
  const auto expect = [&](const std::vector<std::string>& arguments, int code, const std::string& begin) {
    const Finished ended = start(arguments);
    EXPECT_EQ(ended.exit_code, code) << arguments[0] << ": " << ended.standard_error;
    EXPECT_THAT(ended.standard_error, HasSubstr(begin)) << arguments[0];
    EXPECT_EQ(ended.standard_output, "") << "nothing was served";
  };
  const std::string map = folder_ / "map", none = "127.0.0.1:0", file = folder_ / "file", empty = folder_ / "empty";
  std::ofstream(file) << "no certificate";
  fs::create_directory(empty);
  expect({"nowhere", "--listen", none}, 2, "INVALID_ARGUMENT: ");
  expect({empty, "--listen", none}, 3, "UNREACHABLE: ");
  {
    RunningDaemon daemon(served());
    expect({map, "--listen", "8086"}, 2, "INVALID_ARGUMENT: ");
    expect({map, "--listen", none, "--tls-certificate", folder_ / "missing.pem"}, 2, "BAD_CONFIG: ");
    expect({map, "--listen", none, "--tls-certificate", file}, 2, "BAD_CONFIG: ");
    expect({map, "--listen", none, "--tls-key", file}, 2, "INVALID_ARGUMENT: ");
    expect({map, "--listen", none, "--credentials", file}, 2, "BAD_CONFIG: ");
    expect({map, "--listen", none, "--host", "a b"}, 2, "INVALID_ARGUMENT: ");
    expect({map, "--listen", "0.0.0.0:0"}, 2, "BAD_CONFIG: other machines are served over TLS only");
    expect({map, "--listen", "192.0.2.1:0"}, 2, "BAD_CONFIG: cannot listen on 192.0.2.1");
    RunningConsole insecure(console_folder(), {map, "--insecure"}, "0.0.0.0:0");
    EXPECT_THAT(insecure.address(), Not(HasSubstr("0.0.0.0"))) << "nobody can open that";
    EXPECT_EQ(insecure.get("/").status, 200);
    RunningConsole named(folder_ / "named", {map, "--insecure", "--host", "console.lab"}, "0.0.0.0:0");
    EXPECT_TRUE(named.address().starts_with("http://console.lab:")) << named.address();
  }
  // A map that relmapd cannot open: the console starts one, and says that it has ended.
  std::ofstream(folder_ / "map/FORMAT") << "999999\n";
  expect({map, "--listen", none}, 3, "ended with exit code");
}

TEST_F(ConsoleTest, StartsADaemonAndEndsItWithItself) {
  RunningConsole console(console_folder(), {folder_ / "map"});
  EXPECT_THAT(console.log(), HasSubstr("starting one"));
  const std::string me = console.log_in();
  EXPECT_EQ(console.call(kGetStatus, "", me).end.code, 0);
  const auto daemon = client::resolve_server(folder_ / "map").or_throw().pid;
  console.process().signal(SIGTERM);
  EXPECT_EQ(console.process().wait(kPatience), 0);
  EXPECT_TRUE(eventually([&] { return ::kill(static_cast<pid_t>(daemon), 0) != 0; }));
}

// What stands in the list of processes is no secret.
TEST_F(ConsoleTest, OpensABrowserWithoutShowingTheKeyToOthers) {
  RunningDaemon daemon(served());
  const std::string told = folder_ / "told", runtime = folder_ / "runtime", bin = folder_ / "bin";
  fs::create_directory(bin);
  fs::create_directory(runtime);
  fs::permissions(runtime, fs::perms::owner_all);
  std::ofstream(bin + "/xdg-open") << "#!/bin/sh\n{ echo \"$1\"; ls -l /proc/$$/fd; stat -c %a \"${1#file://}\"; cat "
                                      "\"${1#file://}\"; echo end; } > '" +
                                          told + ".new' 2>&1\nmv '" + told + ".new' '" + told + "'\n";
  fs::permissions(bin + "/xdg-open", fs::perms::owner_all);
  {
    RunningConsole console(console_folder(), {folder_ / "map", "--open"}, "127.0.0.1:0",
                           {"PATH=" + bin + ":/usr/bin:/bin", "XDG_RUNTIME_DIR=" + runtime});
    ASSERT_TRUE(eventually([&] { return fs::exists(told); })) << console.log();
    const std::string text = read_text(told);
    const std::string argument = text.substr(0, text.find('\n'));
    EXPECT_TRUE(argument.starts_with("file://" + runtime + "/")) << argument;
    EXPECT_EQ(argument.find(console.key()), std::string::npos);
    EXPECT_THAT(text, AllOf(HasSubstr("\n600\n"), HasSubstr(console.key()), Not(HasSubstr("socket:"))))
        << "it inherits no socket";
    // Nobody else is a child of the console.
    const std::string pid = std::to_string(console.process().pid());
    EXPECT_EQ(read_text("/proc/" + pid + "/task/" + pid + "/children"), "");
    console.process().signal(SIGTERM);
    EXPECT_EQ(console.process().wait(kPatience), 0);
  }
  EXPECT_TRUE(fs::is_empty(runtime)) << "the page is gone";
}

}  // namespace
}  // namespace relmap::testing
