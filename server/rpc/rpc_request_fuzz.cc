// Requests of all methods of the three services, to a small map in memory, over gRPC without a socket. The bytes choose
// up to four calls, and of each its method and its request: any bytes, a message as it is, or one whose fields are set
// one by one, to values that mean something in this map as well as to any. Every answer comes in time, a refusal has a
// reason, what only reads changes nothing, and a map that was edited is sound.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/testing/fuzzing.h"
#include "proto/calibration/calibration_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/status.pb.h"
#include "relmap/v1/watch.pb.h"
#include "server/ingest/mapper_sink.h"
#include "server/rpc/gatekeeper.h"
#include "server/rpc/roles.h"
#include "server/rpc/services.h"
#include "server/rpc/testing/served_map.h"
#include "server/rpc/unreadable_request.h"
#include "storage/maintenance/verify.h"
#include "storage/testing/forwarding_engine.h"

namespace {

using namespace relmap;
using fuzzing::must;
namespace pb = google::protobuf;

constexpr std::size_t kCalls = 4;                       // of one input
constexpr int kFields = 24, kDepth = 4;                 // of one message
constexpr std::size_t kRepeats = 200;                   // of one field
constexpr auto kPatience = std::chrono::minutes(5);     // with sanitizers, on a busy machine
constexpr auto kNews = std::chrono::milliseconds(200);  // in which a daemon tells robots what it has done
constexpr std::uint32_t kAgain = 5;                     // frames of session 3
constexpr std::size_t kBudget = std::size_t{256} << 20;

// The map that a daemon begins with. A daemon serves input after input until one has changed the map.
class SmallMap {
 public:
  SmallMap() {
    // Session 3 drives the beginning of the circuit again while nothing is recognised, so that closures to session 1
    // can be proposed.
    map::MapperOptions unrecognised;
    unrecognised.closures = false;
    map_.restart(unrecognised);
    sim::PointsWorldOptions again = rpc::ServedMap::circuit_options();
    again.frames = kAgain;
    again.noise_seed = 3;
    again.uuid.bytes[15] = 3;
    again.session = "again";
    map_.take_in(sim::PointsWorld(again));
    map_.settle();
    map_.mapper->commit(std::chrono::steady_clock::now() + kPatience).or_throw();
    const storage::Engine& engine = map_.mapper->engine();
    throw_if(engine.snapshot()->scan("", [&](std::string_view key, ByteSpan value) {
      puts_.push_back({std::string(key), {value.begin(), value.end()}});
      return true;
    }));
    applied_ = engine.applied_sequence();
    for (std::uint32_t i = 0; i < rpc::ServedMap::kFrames; ++i)
      for (const storage::Edge& edge : map_.mapper->view()->hot({1, i})->edges) edges.push_back(edge.id);
  }
  std::shared_ptr<storage::Engine> copy() const {
    auto engine = storage::make_memory_engine();
    const std::uint64_t epoch = engine->acquire().or_throw();
    (void)engine->allocate_session(epoch, 2).or_throw();  // the three of the map
    throw_if(engine->commit(epoch, applied_, puts_, {}));
    const std::vector<Bytes> applied(applied_);
    (void)engine->append(epoch, applied).or_throw();
    throw_if(engine->trim(applied_));
    return engine;
  }
  const sim::PointsWorld& circuit() const { return map_.circuit; }

  std::vector<EdgeId> edges;

 private:
  rpc::ServedMap map_;
  std::vector<storage::Put> puts_;
  std::uint64_t applied_ = 0;
};

// Tells of its progress and of itself, as an engine on the disk does.
class TellingEngine final : public storage::ForwardingEngine {
 public:
  explicit TellingEngine(std::shared_ptr<storage::Engine> engine) : ForwardingEngine(std::move(engine)) {}
  Status compact(const storage::EngineProgress& progress) override {
    if (Status going = progress(1, 2); !going.ok()) return going;
    return ForwardingEngine::compact(progress);
  }
  Result<storage::EngineStats> stats() const override {
    auto stats = ForwardingEngine::stats();
    if (stats.ok()) stats->properties.emplace_back("tables", "3");
    return stats;
  }
};

// The services over a copy of the small map.
class Daemon {
 public:
  explicit Daemon(const SmallMap& map)
      : mapper_(map::Mapper::open(std::make_shared<TellingEngine>(map.copy()),
                                  std::make_shared<storage::Budget>(kBudget),
                                  place::random_vocabulary(rpc::ServedMap::kWords, 60, 1), {})
                    .or_throw()),
        core_(*mapper_, {"test", "b007b007b007", "/data", "", false, 4711, 0, {"/nowhere/backups"}}, limits()),
        sink_(*mapper_),
        gateway_(core_.limits, mapper_->budget(), core_.metrics, everyone_, connections_) {
    intake::IngestServerOptions options;
    options.map = mapper_->identity();
    intake_ = std::make_unique<intake::IngestServer>(sink_, mapper_->budget(), BootId{4, 2}, std::move(options));
    mapper_->watch_closures([this](const storage::Graph& graph, const storage::Edge& closure) {
      if (auto told = ingest::closure_news(graph, closure))
        intake_->tell(std::move(told->news), std::move(told->robot));
    });
    core_.intake.server = intake_.get();
    core_.intake.facts = [] {
      rpc::IngestFacts facts;
      facts.lcm = {Reason::IO_ERROR, "gone"};
      facts.not_taken[Reason::CORRUPT] = 1;
      return facts;
    };
    core_.transport = {&connections_, &everyone_};
    core_.process = [] { return rpc::ProcessFacts{1, 2}; };
    services_.push_back(rpc::make_map_service(core_, gateway_));
    services_.push_back(rpc::make_ingest_service(core_, gateway_));
    services_.push_back(rpc::make_admin_service(core_, gateway_));
    grpc::ServerBuilder builder;
    for (const auto& service : services_) builder.RegisterService(service.get());
    std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
    interceptors.push_back(rpc::name_unreadable_requests());
    builder.experimental().SetInterceptorCreators(std::move(interceptors));
    server_ = builder.BuildAndStart();
    must(server_ != nullptr);
    stub_ = std::make_unique<grpc::GenericStub>(server_->InProcessChannel({}));
    settle();
    hash_ = storage::hash_map(*mapper_->view());
  }
  ~Daemon() {
    mapper_->watch_closures({});
    intake_->stop();
    server_->Shutdown(std::chrono::system_clock::now() + kPatience);
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) continue;
  }

  enum class Manner : std::uint8_t {
    kUsual,
    kPatient,  // the daemon has done what the messages ask of it, and says so, before it is told that there are no more
    kLeaves,   // after the first answer
    kWatches,  // until it has been told all that there is
  };
  // Sends the messages of a call, and returns how it ended and what was answered.
  std::pair<grpc::Status, std::vector<std::string>> call(const std::string& path,
                                                         const std::vector<std::string>& messages, Manner manner) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    const auto stream = stub_->PrepareCall(&context, path, &queue_);
    stream->StartCall(this);
    bool open = done();
    for (const std::string& message : messages) {
      if (!open) break;
      const grpc::Slice slice(message);
      stream->Write(grpc::ByteBuffer(&slice, 1), this);
      open = done();
    }
    if (open) {
      if (manner == Manner::kPatient) {
        settle();
        std::this_thread::sleep_for(kNews);
      }
      stream->WritesDone(this);
      (void)done();
    }
    std::vector<std::string> replies;
    for (;;) {
      grpc::ByteBuffer reply;
      stream->Read(&reply, this);
      if (!done()) break;
      grpc::Slice whole;
      if (reply.DumpToSingleSlice(&whole).ok())
        replies.emplace_back(reinterpret_cast<const char*>(whole.begin()), whole.size());
      v1::MapEvent event;
      const bool told = manner == Manner::kWatches && event.ParseFromString(replies.back()) && event.has_caught_up();
      if (manner == Manner::kLeaves || told) context.TryCancel();
    }
    grpc::Status status;
    stream->Finish(&status, this);
    must(done());
    if (manner >= Manner::kLeaves && status.error_code() == grpc::StatusCode::CANCELLED) status = grpc::Status();
    return {status, std::move(replies)};
  }

  // Whether the map is another one; then it is also checked.
  bool changed() {
    settle();
    const auto view = mapper_->view();
    if (storage::hash_map(*view) == hash_) return false;
    (void)storage::verify(*view, {}, [](const storage::Finding& finding) { must(false, finding.what); }, {}).or_throw();
    return true;
  }

 private:
  static rpc::RpcLimits limits() {
    rpc::RpcLimits limits;
    limits.route_steps_per_message = 8;  // so that routes of the small map are resumed
    return limits;
  }
  bool done() {
    void* tag = nullptr;
    bool ok = false;
    must(queue_.Next(&tag, &ok));
    return ok;
  }
  void settle() const { throw_if(mapper_->wait_idle(std::chrono::steady_clock::now() + kPatience)); }

  const rpc::Gatekeeper everyone_{"", true};
  const std::unique_ptr<map::Mapper> mapper_;
  rpc::Core core_;
  ingest::MapperSink sink_;
  std::unique_ptr<intake::IngestServer> intake_;
  rpc::Connections connections_{rpc::ConnectionLimits{}};
  rpc::Gateway gateway_;
  std::vector<std::unique_ptr<grpc::Service>> services_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<grpc::GenericStub> stub_;
  grpc::CompletionQueue queue_;
  storage::MapHash hash_;
};

// Makes messages of bytes.
class Requests {
 public:
  Requests(const SmallMap& map, ByteReader in) : map_(map), in_(in) {}

  bool more() const { return in_.remaining() > 0; }
  std::uint8_t byte() { return in_.get<std::uint8_t>(); }
  std::string bytes() {
    const ByteSpan some = fuzzing::take_up_to(in_, byte());
    return {some.begin(), some.end()};
  }

  // A whole message, with two bytes of length before it. In place of a text "?" and of a mark of 1 it has what an
  // earlier answer said.
  void read(pb::Message& message) {
    const std::string_view some = fuzzing::text_of(fuzzing::take_up_to(in_, in_.get<std::uint16_t>()));
    if (!message.ParsePartialFromArray(some.data(), static_cast<int>(some.size()))) message.Clear();
    const pb::Descriptor& type = *message.GetDescriptor();
    const pb::Reflection& to = *message.GetReflection();
    for (int i = 0; i < type.field_count(); ++i) {
      const pb::FieldDescriptor& field = *type.field(i);
      if (field.is_repeated()) continue;
      if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING && to.GetString(message, &field) == "?")
        to.SetString(&message, &field, heard_);
      if (field.name() == "shown" && to.GetUInt64(message, &field) == 1) to.SetUInt64(&message, &field, shown_);
    }
  }

  // What an earlier answer said may be asked for again: tokens, and what was shown.
  void remember(const pb::Message& reply) {
    const pb::Descriptor& type = *reply.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const pb::FieldDescriptor& field = *type.field(i);
      if (field.is_repeated()) continue;
      if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING)
        heard_ = reply.GetReflection()->GetString(reply, &field).empty()
                     ? heard_
                     : reply.GetReflection()->GetString(reply, &field);
      if (field.name() == "shown") shown_ = reply.GetReflection()->GetUInt64(reply, &field);
    }
  }

  void fill(pb::Message& message, int depth = 0) {
    if (known(message)) return;
    const pb::Descriptor& type = *message.GetDescriptor();
    if (type.field_count() == 0) return;
    for (int i = 0; i < kFields && more(); ++i) {
      const std::uint8_t which = byte();
      if (which % 32 == 31) return;
      const pb::FieldDescriptor& field = *type.field(which % 32 % type.field_count());
      const std::size_t times = which >= 224 && field.is_repeated() ? kRepeats : 1;
      if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
        if (depth == kDepth) continue;
        const std::unique_ptr<pb::Message> value(
            pb::MessageFactory::generated_factory()->GetPrototype(field.message_type())->New());
        fill(*value, depth + 1);
        for (std::size_t n = 0; n < times; ++n)
          (field.is_repeated() ? message.GetReflection()->AddMessage(&message, &field)
                               : message.GetReflection()->MutableMessage(&message, &field))
              ->CopyFrom(*value);
      } else {
        set(message, field, times);
      }
    }
  }

 private:
  // Messages that mean something here.
  bool known(pb::Message& message) {
    const std::string& name = message.GetDescriptor()->name();
    const bool has = name == "View" || name == "KeyframePayload" || name == "EdgeId" || name == "FrameId" ||
                     name == "Hello" || name == "Covariance" || name == "Transform" || name == "FeatureSet" ||
                     name == "ImportedFrame" || name == "Picture" || name == "Camera" || name == "RawStereo";
    if (!has) return false;
    const std::uint8_t which = byte();
    if (which % 4 == 0) return false;
    const std::uint32_t i = which / 4u % rpc::ServedMap::kFrames;
    const Keyframe keyframe = map_.circuit().keyframe(i);
    if (name == "View") {
      v1::View view;
      if (which % 4 == 1) *view.mutable_frame() = to_wire(FrameId{1, i});
      if (which % 4 != 1) *view.mutable_features() = to_wire(keyframe.appearance);
      if (which % 4 == 2) *view.mutable_camera() = to_wire(keyframe.session.camera);
      if (which % 4 == 3) view.set_session(1);
      message.CopyFrom(view);
    } else if (name == "KeyframePayload") {
      v1::KeyframePayload wire;
      Keyframe next = keyframe;
      if (which % 4 != 1) {  // of a new session, of another camera before rectification
        next.session.uuid.bytes[15] = 9;
        next.session.raw = sample_raw_calibration(3);
      }
      const Bytes payload = encode_keyframe(next);
      wire.set_session_uuid(uuid_to_wire(next.session.uuid));
      wire.set_sequence(which % 4 == 3 ? i + 100 : next.sequence);
      wire.set_crc32c(crc32c(payload));
      wire.set_payload(payload.data(), payload.size());
      message.CopyFrom(wire);
    } else if (name == "EdgeId") {
      message.CopyFrom(to_wire(map_.edges[which / 4u % map_.edges.size()]));
    } else if (name == "FrameId") {
      message.CopyFrom(to_wire(which % 4 == 1 ? FrameId{2, i % rpc::ServedMap::kElsewhere} : FrameId{1, i}));
    } else if (name == "Hello") {
      v1::Hello hello;
      hello.mutable_protocol()->set_major(kProtocolMajor);
      hello.set_robot("robot");
      message.CopyFrom(hello);
    } else if (name == "Covariance") {
      message.CopyFrom(to_wire(Matrix6(0.01 * (1 + i) * Matrix6::Identity())));
    } else if (name == "Transform") {
      message.CopyFrom(to_wire(map_.circuit().T_world_frame(i)));
    } else if (name == "FeatureSet") {
      message.CopyFrom(to_wire(keyframe.appearance));
    } else if (name == "ImportedFrame") {
      v1::ImportedFrame frame;
      *frame.mutable_odom_from_frame() = to_wire(map_.circuit().T_world_frame(i));
      *frame.mutable_step() = to_wire(Matrix6(0.01 * Matrix6::Identity()));
      frame.set_time_us(1'000'000 * (i + 1));
      frame.set_driven_us(500'000);
      message.CopyFrom(frame);
    } else if (name == "Picture") {
      v1::Picture picture;
      picture.set_data(map_.circuit().keyframe(i).picture.data(), keyframe.picture.size());
      message.CopyFrom(picture);
    } else if (name == "Camera") {
      message.CopyFrom(to_wire(keyframe.session.camera));
    } else {
      v1::RawStereo raw;
      raw.set_width(640);
      raw.set_height(480);
      for (auto* eye : {raw.mutable_left(), raw.mutable_right()}) {
        eye->set_fx(500);
        eye->set_fy(501);
        eye->set_cx(320);
        eye->set_cy(240);
        eye->set_k1(-0.1);
      }
      raw.mutable_right_from_left()->mutable_rotation()->set_w(1);
      raw.mutable_right_from_left()->mutable_translation()->set_x(-0.2);
      message.CopyFrom(raw);
    }
    return true;
  }

  std::uint64_t whole_number() {
    static constexpr std::uint64_t kKnown[] = {0, 1, 2, 3, 7, 49, 50, 1000, 0x7fffffff, 0xffffffff, ~std::uint64_t{0}};
    const std::uint8_t which = byte();
    if (which < std::size(kKnown)) return kKnown[which];
    if (which == std::size(kKnown)) return shown_;
    return which < 128 ? in_.get<std::uint64_t>() : which - 128u;
  }
  double number() {
    static constexpr double kKnown[] = {0,
                                        -0.0,
                                        1,
                                        -1,
                                        0.5,
                                        1e-300,
                                        1e300,
                                        1e9,
                                        std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::quiet_NaN()};
    const std::uint8_t which = byte();
    if (which < std::size(kKnown)) return kKnown[which];
    return which < 128 ? in_.get<double>() : which - 128.0;
  }
  std::string text(bool of_bytes) {
    const std::uint8_t which = byte();
    switch (which % 12) {
      case 0:
        return heard_;
      case 1:
        return uuid_to_wire(map_.circuit().keyframe(0).session.uuid);
      case 2:
        return map_.circuit().keyframe(0).session.uuid.to_string();
      case 3:
        return map_.circuit().keyframe(0).session.name;
      case 4:
        return map_.circuit().keyframe(0).session.robot;
      case 5:
        return "fountain";
      case 6:
        return std::string(70000, 'x');
      case 7:
        return of_bytes ? std::string(128, static_cast<char>(which)) : "\xc3\xa4 \xe2\x80\xae";
      case 8: {
        Uuid uuid;
        uuid.bytes[0] = which;
        return uuid_to_wire(uuid);
      }
      case 9:
        return "/nowhere/backups/one";
      default:
        return bytes();
    }
  }

  void set(pb::Message& message, const pb::FieldDescriptor& field, std::size_t times) {
    const pb::Reflection& to = *message.GetReflection();
    const auto put = [&](auto set_one, auto add_one, auto value) {
      if (!field.is_repeated()) return (to.*set_one)(&message, &field, value);
      for (std::size_t n = 0; n < times; ++n) (to.*add_one)(&message, &field, value);
    };
    using R = pb::Reflection;
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32:
        return put(&R::SetInt32, &R::AddInt32, static_cast<std::int32_t>(whole_number()));
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return put(&R::SetInt64, &R::AddInt64, static_cast<std::int64_t>(whole_number()));
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        return put(&R::SetUInt32, &R::AddUInt32, static_cast<std::uint32_t>(whole_number()));
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        return put(&R::SetUInt64, &R::AddUInt64, whole_number());
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return put(&R::SetDouble, &R::AddDouble, number());
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return put(&R::SetFloat, &R::AddFloat, static_cast<float>(number()));
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        return put(&R::SetBool, &R::AddBool, byte() % 2 == 1);
      case pb::FieldDescriptor::CPPTYPE_ENUM:
        return put(&R::SetEnumValue, &R::AddEnumValue, static_cast<int>(byte()) - 2);
      case pb::FieldDescriptor::CPPTYPE_STRING: {
        const std::string value = text(field.type() == pb::FieldDescriptor::TYPE_BYTES);
        if (!field.is_repeated()) return to.SetString(&message, &field, value);
        for (std::size_t n = 0; n < std::min<std::size_t>(times, 8); ++n) to.AddString(&message, &field, value);
        return;
      }
      case pb::FieldDescriptor::CPPTYPE_MESSAGE:
        return;
    }
  }

  const SmallMap& map_;
  ByteReader in_;
  std::string heard_;
  std::uint64_t shown_ = 0;
};

std::vector<const pb::MethodDescriptor*> methods() {
  std::vector<const pb::MethodDescriptor*> all;
  for (const auto* file : {v1::LocaliseRequest::descriptor()->file(), v1::IngestRequest::descriptor()->file(),
                           v1::VerifyRequest::descriptor()->file()})
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m) all.push_back(file->service(s)->method(m));
  return all;
}

// A refusal has a known code, and names a reason that goes with it.
void check_status(const std::string& method, const grpc::Status& status) {
  if (status.ok()) return;
  const std::string what = method + ": " + std::to_string(status.error_code()) + " " + status.error_message();
  must(status.error_code() > 0 && status.error_code() <= grpc::StatusCode::UNAUTHENTICATED, what);
  v1::Error error;
  must(error.ParseFromString(status.error_details()), what);
  const Reason reason = reason_from_wire(error.reason());
  must(reason != Reason::OK && is_reason(static_cast<std::uint16_t>(reason)) && reason != Reason::INTERNAL, what);
  must(!error.message().empty(), what);
}

// May it change the map?
bool edits(const pb::MethodDescriptor& method) {
  const auto role = rpc::required_role(method.service()->name() + "." + method.name());
  must(role.has_value());
  return *role != rpc::Role::kReader;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<const pb::MethodDescriptor*> kMethods = methods();
  static const SmallMap* const kMap = [] {
    spdlog::set_level(spdlog::level::off);
    return new SmallMap;
  }();
  static std::unique_ptr<Daemon> daemon = std::make_unique<Daemon>(*kMap);
  Requests requests(*kMap, ByteReader({data, size}));
  bool may_change = false;
  for (std::size_t n = 0; n < kCalls && requests.more(); ++n) {
    const pb::MethodDescriptor& method = *kMethods[requests.byte() % kMethods.size()];
    const std::uint8_t how = requests.byte();
    std::vector<std::string> messages;
    for (int count = method.client_streaming() ? how / 2 % 8 : 1; count > 0; --count) {
      if (how % 2 == 1 && how < 128) {
        messages.push_back(requests.bytes());
        continue;
      }
      const std::unique_ptr<pb::Message> request(
          pb::MessageFactory::generated_factory()->GetPrototype(method.input_type())->New());
      if (how % 2 == 1)
        requests.read(*request);
      else
        requests.fill(*request);
      messages.push_back(request->SerializePartialAsString());
    }
    may_change = may_change || edits(method);
    const auto [status, replies] = daemon->call("/" + method.service()->full_name() + "/" + method.name(), messages,
                                                method.name() == "WatchMap" ? Daemon::Manner::kWatches
                                                : how < 192                 ? Daemon::Manner::kUsual
                                                : method.client_streaming() ? Daemon::Manner::kPatient
                                                                            : Daemon::Manner::kLeaves);
    check_status(method.full_name(), status);
    for (const std::string& reply : replies) {
      const std::unique_ptr<pb::Message> answer(
          pb::MessageFactory::generated_factory()->GetPrototype(method.output_type())->New());
      must(answer->ParseFromString(reply), method.full_name() + ": an answer that cannot be read");
      requests.remember(*answer);
    }
  }
  if (daemon->changed()) {
    must(may_change, "a reader has changed the map");
    daemon.reset();
    daemon = std::make_unique<Daemon>(*kMap);
  }
  return 0;
}
