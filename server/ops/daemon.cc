#include "server/ops/daemon.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <numeric>

#include "proto/base/clock.h"
#include "proto/base/hex.h"
#include "proto/base/mutex.h"
#include "proto/base/version.h"
#include "server/ingest/lcm_ingest.h"
#include "server/ingest/mapper_sink.h"
#include "server/monitor/clock_watch.h"
#include "server/monitor/health.h"
#include "server/monitor/http_server.h"
#include "server/monitor/metrics_page.h"
#include "server/ops/endpoint.h"
#include "server/ops/private_folder.h"
#include "server/ops/process.h"
#include "server/ops/settings.h"
#include "server/ops/signals.h"
#include "server/ops/socket_path.h"
#include "server/route/overlay/route_index.h"
#include "server/rpc/handshake_log.h"
#include "server/rpc/log_level.h"
#include "server/rpc/server.h"
#include "server/service/periodic.h"
#include "storage/io/file.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::ops {

namespace {

constexpr std::chrono::seconds kPatience{5};  // that running calls get to end at a stop
constexpr std::chrono::minutes kReportInterval{1};
constexpr std::chrono::seconds kCertificateInterval{10};
constexpr std::chrono::milliseconds kPulse{500};  // between looks at the daemon's health

rpc::IngestFacts facts_of(const intake::IngestStats& stats, const Status& lcm) {
  rpc::IngestFacts facts;
  facts.lcm = lcm;
  facts.parts = stats.parts;
  facts.parts_corrupt = stats.parts_refused[intake::index_of(Reason::CORRUPT)];
  facts.keyframes = stats.keyframes_received;
  facts.repeats = stats.repeated_parts;
  facts.acknowledgements = stats.acknowledgements;
  facts.robots = stats.heard;
  facts.incomplete = stats.incomplete;
  for (std::size_t number = 0; number < stats.parts_refused.size(); ++number) {
    // Keyframes refused for good are counted by the map once their session has begun; others are asked for again, or
    // were no message.
    const std::uint64_t count =
        stats.parts_refused[number] + stats.messages_refused[number] + stats.refused_before_begin[number];
    if (count > 0) facts.not_taken[static_cast<Reason>(number)] = count;
  }
  return facts;
}

Result<std::shared_ptr<const place::Vocabulary>> load_vocabulary(const Config& config) {
  return place::Vocabulary::load(config.vocabulary.empty() ? place::default_vocabulary_path() : config.vocabulary);
}

// Adds which command can repair the map, or compute its words again.
Status with_advice(const Status& status, const Config& config) {
  if (status.reason() == Reason::DATA_LOSS)
    return {status.reason(), status.message() + "; relmap-admin repair " + config.data + " keeps what can be read"};
  if (status.reason() == Reason::WRONG_VOCABULARY)
    return {status.reason(), status.message() + "; relmap-admin reindex " + config.data +
                                 (config.vocabulary.empty() ? "" : " --vocabulary " + config.vocabulary) +
                                 " makes them anew (or --vocabulary names the one that the map was made with)"};
  return status;
}

// The secret of the fleet's keys for LCM; zeros if it is not needed.
Result<access::SealKey> read_lcm_secret(const Config& config) {
  if (config.lcm.empty() || config.lcm_authentication == ingest::LcmAuthentication::Who::kNobody)
    return access::SealKey{};
  auto secret = access::read_secret(config.lcm_key);
  if (!secret.ok()) return Status(Reason::BAD_CONFIG, secret.status().message());
  return secret;
}

void log(const intake::RobotEvent& event) {
  const std::string session = "session " + std::to_string(event.session) + " '" + event.name + "'";
  switch (event.kind) {
    case intake::RobotEvent::Kind::kHeard:
      return spdlog::info("robot {} sends keyframes for {}; the next is {}", event.robot, session, event.next_sequence);
    case intake::RobotEvent::Kind::kSilent:
      return spdlog::info("robot {} has been silent for {} s; {} has not ended, the next keyframe is {}", event.robot,
                          event.silent.count(), session, event.next_sequence);
    case intake::RobotEvent::Kind::kSameName:
      return spdlog::warn("two robots are called {}: one sends for {}, another one for a session of its own",
                          event.robot, session);
  }
}

}  // namespace

struct Daemon::Impl {
  explicit Impl(Config c) : config(std::move(c)), hung_after_s(config.hung_after_s) {}

  Status open_map();
  Status serve();
  Status serve_http();
  Status write_endpoints() const;
  void remove_endpoints() const;
  std::string socket_folder() const;  // where a second file `endpoint` lies; empty: nowhere
  monitor::Signs signs() const;
  rpc::HealthFacts health() const;
  monitor::HttpPage page(std::string_view path);
  void beat();
  void start_lcm();
  DaemonStatus lcm_status() const;
  void report() const;
  void reload_access();
  void look_at_certificate();
  void look_at_disk();
  Status stop();

  Config config;  // of the main thread; live settings change
  std::atomic<double> hung_after_s;
  std::atomic<bool> leaving = false;
  std::atomic<std::uint64_t> free_bytes = UINT64_MAX;  // of the data folder's disk, at the last look
  monitor::ClockWatch clock;
  const BootId boot = SessionUuid::random().bytes;
  const std::int64_t started_us = now_us();

  // In order of construction; destroyed in reverse order.
  std::shared_ptr<storage::Budget> budget;
  std::unique_ptr<map::Mapper> mapper;
  std::unique_ptr<ingest::MapperSink> sink;
  std::unique_ptr<intake::IngestServer> ingest;
  std::unique_ptr<intake::IngestServer::Subscription> robot_log;
  std::unique_ptr<ingest::LcmIngest> lcm;
  mutable Mutex lcm_mutex;
  Status lcm_refusal RELMAP_GUARDED_BY(lcm_mutex);  // why LCM ingest does not run
  std::unique_ptr<rpc::Core> core;
  std::unique_ptr<rpc::Gatekeeper> gatekeeper;
  std::unique_ptr<rpc::AuditLog> audit;
  std::unique_ptr<rpc::TlsWatch> tls_watch;  // null without TLS
  std::unique_ptr<rpc::RpcServer> server;
  std::unique_ptr<monitor::MetricsPage> metrics;
  std::unique_ptr<monitor::HttpServer> http;
  std::unique_ptr<service::Periodic> pulse;
  std::string socket, address, http_address;
  access::SealKey lcm_secret{};
  std::uint64_t lcm_access_version = 0;  // of the access list that LCM uses
  // With the access list and the certificate, which is logged once.
  std::string access_problem, certificate_problem;
  std::chrono::steady_clock::time_point certificate_looked;

  std::chrono::steady_clock::time_point reported = std::chrono::steady_clock::now();
  bool stopped = false;
  std::uint64_t low_water = 0;  // with fewer free bytes on the disk nothing is taken in
};

Status Daemon::Impl::open_map() {
  auto vocabulary = load_vocabulary(config);
  if (!vocabulary.ok()) return vocabulary.status();
  if (Status made = storage::create_durable_directories(*storage::posix_file_system(), config.data); !made.ok())
    return made;
  if (const Status closed = make_private(config.data, config.socket_group); closed.reason() == Reason::BAD_CONFIG)
    return closed;
  else if (!closed.ok())
    spdlog::warn("others may be able to read the map: {}", closed.to_string());
  budget = std::make_shared<storage::Budget>(config.memory_budget_mb << 20);
  storage::RocksDbOptions options;
  options.cache_bytes = budget->allowance(storage::Share::kEngine);
  options.or_read_only = true;
  // At least enough for a commit of everything that may be dirty.
  low_water = std::max<std::uint64_t>(config.disk_low_water_mb << 20, budget->allowance(storage::Share::kDirty));
  if (const auto room = storage::posix_file_system()->room(config.data); room.ok())
    low_water = std::min(low_water, room->size / 16);
  options.space.low_water = low_water;
  auto engine = storage::open_rocksdb(config.data, options);
  if (!engine.ok()) return engine.status();
  const auto stats = (*engine)->stats();
  if (stats.ok() && !stats->dropped.empty()) spdlog::warn("{}: {}", config.data, stats->dropped);
  remove_endpoints();  // left by a daemon that crashed
  map::MapperOptions map_options = config.map;
  map_options.folder = config.data;
  map_options.events.max_bytes = config.events_max_mb << 20;
  map_options.leaving = is_told_to_stop;
  auto opened = map::Mapper::open(*engine, budget, *vocabulary, map_options);
  if (!opened.ok()) return opened.status();
  mapper = std::move(opened).value();
  sink = std::make_unique<ingest::MapperSink>(*mapper);
  intake::IngestServerOptions ingest_options;
  ingest_options.map = mapper->identity();
  ingest_options.max_keyframes_per_s = config.max_keyframes_per_s;
  ingest_options.max_new_sessions_per_min = config.max_new_sessions_per_min;
  ingest_options.robots = {config.robots.begin(), config.robots.end()};
  ingest_options.proving = {config.lcm_proving.begin(), config.lcm_proving.end()};
  ingest_options.part_queue_bytes = config.lcm.empty() ? 0 : budget->allowance(storage::Share::kReassembly) / 4;
  ingest = std::make_unique<intake::IngestServer>(*sink, *budget, boot, std::move(ingest_options));
  robot_log = ingest->subscribe({.acknowledged = {}, .news = {}, .stopping = {}, .robot = log});
  mapper->watch_closures([this](const storage::Graph& map, const storage::Edge& closure) {
    if (auto told = ingest::closure_news(map, closure)) ingest->tell(std::move(told->news), std::move(told->robot));
  });
  return {};
}

Status Daemon::Impl::serve() {
  rpc::DaemonFacts facts;
  facts.version = version();
  facts.commit = build_commit();
  facts.boot_id = hex(boot);
  facts.data_folder = std::filesystem::absolute(config.data).string();
  facts.lcm_url = config.lcm;
  facts.backup_roots = config.backup_roots;
  facts.deterministic = config.map.deterministic;
  facts.pid = static_cast<std::uint64_t>(getpid());
  facts.started_us = started_us;
  core = std::make_unique<rpc::Core>(*mapper, facts, config.rpc);
  core->intake.facts = [this] {
    const intake::IngestStats stats = ingest->stats();  // first: it may wait, and health must not wait for the mutex
    const MutexLock lock(lcm_mutex);
    return facts_of(stats, lcm_refusal);
  };
  core->intake.server = ingest.get();
  core->process = [] {
    return rpc::ProcessFacts{resident_bytes(), peak_resident_bytes(), cpu_seconds(), open_files(), max_files()};
  };
  core->health = [this] { return health(); };
  core->routes.index = std::make_unique<route::RouteIndex>(
      route::RouteIndexOptions{config.data, 2 * low_water, config.route_metrics()}, [this] { return mapper->view(); },
      budget);
  mapper->watch_edits([this](std::uint64_t version, std::span<const storage::ChunkId> chunks) {
    core->routes.index->changed(version, chunks);
  });
  core->routes.index->start();
  mapper->use_route_map([this] { return core->routes.index->snapshot(); });

  auto path = config.socket.empty() ? socket_path(config.data) : config.socket;
  if (!path.ok()) return path.status();
  socket = std::move(*path);
  rpc::ServerOptions options{socket, config.socket_group, {}, 0, config.tls, config.connections};
  if (config.audit != "none") {
    auto opened = rpc::AuditLog::open(config.audit.empty() ? config.data + "/audit.jsonl" : config.audit);
    if (!opened.ok() && !config.audit.empty()) return {Reason::BAD_CONFIG, opened.status().message()};
    if (!opened.ok()) spdlog::warn("there is no audit log: {}", opened.status().to_string());
    if (opened.ok()) audit = std::move(*opened);
    options.audit = audit.get();
  }
  if (!config.listen.empty()) {
    const auto where = parse_host_port(config.listen);
    if (!where.ok()) return where.status();
    options.host = where->host;
    options.port = where->port;
  }
  gatekeeper = std::make_unique<rpc::Gatekeeper>(config.access, config.insecure);
  if (Status known = gatekeeper->reload(); !known.ok()) return {Reason::BAD_CONFIG, known.message()};
  const auto secret = read_lcm_secret(config);
  if (!secret.ok()) return secret.status();
  lcm_secret = *secret;
  if (config.insecure && !config.listen.empty())
    spdlog::warn("--insecure: everyone who can reach {} may edit the map", config.listen);
  if (!config.tls.certificate.empty() && (!options.host.empty() || !config.http.empty())) {
    if (!options.host.empty()) rpc::log_failed_handshakes();
    tls_watch = std::make_unique<rpc::TlsWatch>(config.tls);
    options.tls_watch = tls_watch.get();
    look_at_certificate();
  }
  auto started = rpc::RpcServer::start(*core, *gatekeeper, options);
  if (!started.ok()) return started.status();
  server = std::move(started).value();
  if (!options.host.empty()) address = HostPort{options.host, server->port()}.to_string();
  start_lcm();
  if (Status opened = serve_http(); !opened.ok()) return opened;
  pulse = std::make_unique<service::Periodic>(kPulse, [this] { beat(); });
  const Status written = write_endpoints();
  if (written.ok() || mapper->stats().storage.reason() != Reason::READ_ONLY) return written;
  spdlog::warn("clients find the daemon only by --server unix:{}{}: {}", socket,
               address.empty() ? std::string() : " or " + address, written.to_string());
  return {};
}

Status Daemon::Impl::serve_http() {
  if (config.http.empty()) return {};
  const auto where = parse_http(config.http);
  if (!where.ok()) return where.status();
  metrics = std::make_unique<monitor::MetricsPage>(*core, config.data, low_water);
  auto started = monitor::HttpServer::start({where->host, where->port, config.tls}, *gatekeeper,
                                            [this](std::string_view path) { return page(path); });
  if (!started.ok()) return started.status();
  http = std::move(*started);
  http_address = HostPort{where->host, http->port()}.to_string();
  return {};
}

std::string Daemon::Impl::socket_folder() const {
  return config.socket.empty() ? std::string() : std::filesystem::path(config.socket).parent_path().string();
}

Status Daemon::Impl::write_endpoints() const {
  for (const std::string& folder : {config.data, socket_folder()}) {
    if (folder.empty()) continue;
    if (Status written = write_endpoint(folder, {socket, address, getpid(), hex(boot), http_address}); !written.ok())
      return written;
    if (config.socket_group.empty()) continue;
    if (Status shared = share_with_group(folder + "/endpoint", config.socket_group); !shared.ok()) return shared;
  }
  return {};
}

void Daemon::Impl::remove_endpoints() const {
  remove_endpoint(config.data);
  if (!config.socket.empty()) remove_endpoint(socket_folder());
}

monitor::Signs Daemon::Impl::signs() const {
  monitor::Signs signs;
  signs.map = mapper->progress();
  signs.intake_s = ingest->busy_s();
  signs.free_bytes = free_bytes;
  signs.low_water = low_water;
  signs.stopping = leaving;
  signs.hung_after_s = hung_after_s;
  const MutexLock lock(lcm_mutex);
  signs.lcm = lcm_refusal;
  return signs;
}

rpc::HealthFacts Daemon::Impl::health() const {
  rpc::HealthFacts health = monitor::judge(signs());
  health.clock_steps = clock.steps();
  health.clock_step_s = clock.last_step_s();
  health.clock_step_age_s = clock.last_step_age_s();
  return health;
}

monitor::HttpPage Daemon::Impl::page(std::string_view path) {
  if (path == "/livez" || path == "/readyz") {
    const rpc::HealthFacts now = health();
    const bool ready_asked = path == "/readyz";
    return {(ready_asked ? now.ready() : now.live) ? 200u : 503u, monitor::health_page(now, ready_asked)};
  }
  if (path == "/metrics") {
    auto text = metrics->text();
    if (!text) return {503, "BUDGET_EXCEEDED: another scrape is under way\n"};
    return {200, std::move(*text), "text/plain; version=0.0.4; charset=utf-8"};
  }
  return {404, "there are /metrics, /livez and /readyz\n"};
}

// What changes by itself is told.
void Daemon::Impl::beat() {
  clock.look();
  monitor::Signs now = signs();
  const bool live = monitor::judge(now).live;
  now.lcm = {};  // robots over gRPC do not need it
  server->set_serving("", live);
  server->set_serving("relmap.v1.Map", live);
  server->set_serving("relmap.v1.Admin", live);
  server->set_serving("relmap.v1.Ingest", monitor::judge(now).ready());
}

void Daemon::Impl::start_lcm() {
  if (config.lcm.empty()) return;
  ingest::LcmOptions options;
  options.url = config.lcm;
  options.queue_bytes = budget->allowance(storage::Share::kReassembly) / 4;
  options.authentication.who = config.lcm_authentication;
  if (options.authentication.who == ingest::LcmAuthentication::Who::kNobody)
    spdlog::warn("lcm.authentication is none: whoever can send to {} can send in the name of any robot", config.lcm);
  else
    options.authentication.secret = lcm_secret;
  auto started = ingest::LcmIngest::start(options, *ingest, [this] { return lcm_status(); });
  if (started.ok()) {
    budget->charge(storage::Share::kReassembly, options.queue_bytes);  // while the daemon runs
    lcm = std::move(started).value();
    lcm->use(*gatekeeper->list());
    return;
  }
  spdlog::error("no LCM ingest: {}; gRPC goes on serving", started.status().to_string());
  const MutexLock lock(lcm_mutex);
  lcm_refusal = started.status();
}

DaemonStatus Daemon::Impl::lcm_status() const {
  const auto view = mapper->view();
  const map::MapperStats stats = mapper->stats();
  DaemonStatus status;
  status.version = version();
  status.sessions = view->session_counts().all;
  status.keyframes = view->state().keyframes;
  status.refused = std::accumulate(view->state().refused.begin(), view->state().refused.end(), std::uint64_t{0});
  status.closures_accepted = view->state().closures_accepted;
  status.durable_sequence = stats.durable_sequence;
  status.applied_sequence = stats.applied_sequence;
  status.memory_used = budget->used();
  status.memory_budget = budget->limit();
  status.reason = stats.storage.reason();
  return status;
}

void Daemon::Impl::report() const {
  const auto view = mapper->view();
  const map::MapperStats stats = mapper->stats();
  spdlog::info("{} keyframes, {} loop closures, {} records queued, {} lookups behind; {} of {} MB used, {} MB resident",
               view->state().keyframes, view->state().closures_accepted, stats.queued, stats.lookup_lag,
               budget->used() >> 20, budget->limit() >> 20, resident_bytes() >> 20);
}

void Daemon::Impl::look_at_certificate() {
  certificate_looked = std::chrono::steady_clock::now();
  if (!tls_watch) return;
  const Status state = tls_watch->look(now_us() / 1'000'000);
  if (!state.ok() && state.message() != certificate_problem) spdlog::warn("TLS: {}", state.to_string());
  certificate_problem = state.message();
}

void Daemon::Impl::look_at_disk() {
  if (const auto room = storage::posix_file_system()->room(config.data); room.ok()) free_bytes = room->free;
}

void Daemon::Impl::reload_access() {
  const Status read = gatekeeper->reload_if_changed();
  if (!read.ok() && read.message() != access_problem)
    spdlog::error("the access list stays as it was: {}", read.to_string());
  access_problem = read.message();
  if (lcm && gatekeeper->version() != lcm_access_version) {
    lcm_access_version = gatekeeper->version();
    lcm->use(*gatekeeper->list());
  }
}

Status Daemon::Impl::stop() {
  if (stopped) return {};
  stopped = true;
  leaving = true;
  if (server) server->announce_stop();
  pulse.reset();
  if (mapper) mapper->watch_closures({});
  if (lcm) lcm->stop();
  if (ingest) ingest->stop();
  if (server) {
    server->stop(kPatience);
    remove_endpoints();
  }
  if (core && core->routes.index) core->routes.index->stop();
  const Status stopped_in_order = mapper ? mapper->stop() : Status();
  if (core && core->routes.index) {
    mapper->watch_edits({});
    mapper->use_route_map({});
    const Status saved = stopped_in_order.ok() ? core->routes.index->save() : Status();
    if (!saved.ok()) spdlog::warn("cells of routes will be made anew: {}", saved.to_string());
    http.reset();  // its pages tell of the index
    core->routes.index.reset();
  }
  http.reset();
  return stopped_in_order;
}

Daemon::Daemon(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Daemon::~Daemon() {
  if (const Status status = stop(); !status.ok()) spdlog::error("stopped with {}", status.to_string());
}

Status Daemon::check(const Config& config) {
  if (Status sound = check_config(config); !sound.ok()) return sound;
  if (const auto vocabulary = load_vocabulary(config); !vocabulary.ok()) return vocabulary.status();
  if (Status sound = rpc::check_files(config.tls); !sound.ok()) return sound;
  if (const Status state = rpc::tls_state(config.tls, now_us() / 1'000'000); !state.ok())
    spdlog::warn("TLS: {}", state.to_string());
  if (Status known = rpc::Gatekeeper(config.access).reload(); !known.ok()) return {Reason::BAD_CONFIG, known.message()};
  if (const auto secret = read_lcm_secret(config); !secret.ok()) return secret.status();
  return storage::check_data_folder(config.data);
}

Result<std::unique_ptr<Daemon>> Daemon::start(const Config& config) {
  if (Status status = check_config(config); !status.ok()) return status;
  std::unique_ptr<Daemon> daemon(new Daemon(std::make_unique<Impl>(config)));
  if (Status status = daemon->impl_->open_map(); !status.ok()) return with_advice(status, config);
  if (Status status = daemon->impl_->serve(); !status.ok()) return status;
  spdlog::info("relmapd {} serves {} at {}{}{}{}", version(), config.data, daemon->socket(),
               daemon->address().empty() ? std::string() : ", gRPC on " + daemon->address(),
               daemon->http().empty() ? std::string() : ", HTTP on " + daemon->http(),
               daemon->impl_->lcm ? ", LCM on " + config.lcm : std::string());
  return daemon;
}

const std::string& Daemon::socket() const { return impl_->socket; }
const std::string& Daemon::address() const { return impl_->address; }

void Daemon::tick() {
  const auto now = std::chrono::steady_clock::now();
  impl_->core->views.expire();
  impl_->core->routes.found.expire();
  impl_->reload_access();
  impl_->look_at_disk();
  if (now - impl_->certificate_looked >= kCertificateInterval) impl_->look_at_certificate();
  give_back_free_memory();
  storage::Budget& budget = impl_->mapper->budget();
  budget.set(storage::Share::kAllocator,
             std::min(allocator_holes_bytes(), budget.allowance(storage::Share::kAllocator)));
  if (now - impl_->reported >= kReportInterval) {
    impl_->reported = now;
    impl_->report();
  }
}

const std::string& Daemon::http() const { return impl_->http_address; }

rpc::HealthFacts Daemon::health() const { return impl_->health(); }

std::string Daemon::status_line() const {
  const auto view = impl_->mapper->view();
  return std::to_string(view->state().keyframes) + " keyframes of " + std::to_string(view->session_counts().all) +
         " sessions; " + monitor::in_short(health());
}

bool Daemon::reload(const Config& fresh) {
  Config& config = impl_->config;
  bool all = true;
  const std::string former_level = config.log_level;
  for (const Status& refused : adopt_live(fresh, config)) {
    spdlog::error("SIGHUP: {}", refused.to_string());
    all = false;
  }
  if (config.log_level != former_level) rpc::set_log_level(config.log_level);  // or as relmap-admin log-level says
  impl_->hung_after_s = config.hung_after_s;
  impl_->ingest->limit(
      {config.max_keyframes_per_s, config.max_new_sessions_per_min, {config.robots.begin(), config.robots.end()}});
  const Status read = impl_->gatekeeper->reload(), sound = rpc::check_files(impl_->config.tls);
  if (!read.ok()) spdlog::error("the access list stays as it was: {}", read.to_string());
  if (!sound.ok()) {
    spdlog::error("the certificate stays as it was: {}", sound.to_string());
    impl_->certificate_problem = sound.message();  // it has been said
  }
  impl_->look_at_certificate();
  impl_->access_problem = read.message();
  return all && read.ok() && sound.ok();
}

Status Daemon::stop() { return impl_->stop(); }

}  // namespace relmap::ops
