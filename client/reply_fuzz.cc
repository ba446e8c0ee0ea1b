// Any bytes as the replies of a daemon, which the client takes for what they say: it ends with values or CORRUPT. And
// what the client asks can be read. The first byte chooses the message.
#include <algorithm>
#include <string>
#include <utility>
#include <variant>

#include "client/replies.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/base/utf8.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/status.pb.h"
#include "relmap/v1/watch.pb.h"

namespace {

using namespace relmap;
using namespace relmap::client;
using fuzzing::must;

template <typename Value>
void check(const Result<Value>& read) {
  must(read.ok() || (read.reason() == Reason::CORRUPT && !read.status().message().empty()));
}

template <typename Message, typename Value>
void read_as(ByteSpan bytes, Result<Value> (*read)(const Message&)) {
  Message message;
  if (message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) check(read(message));
}
template <typename Message, typename Value>
void read_as(ByteSpan bytes, Value (*read)(const Message&)) {
  Message message;
  if (message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) (void)read(message);
}

View view_of(ByteReader& in) {
  View view;
  const auto left = fuzzing::take_up_to(in, 3), right = fuzzing::take_up_to(in, 3);
  view.left = fuzzing::text_of(left);
  view.right = fuzzing::text_of(right);
  const auto which = in.get<std::uint8_t>();
  switch (which % 5) {
    case 0:
      view.frame = FrameId{which, in.get<std::uint32_t>()};
      break;
    case 1:
      view.camera = StereoCamera{in.get<double>(), 320, 240, 0.1, 640, 480};
      break;
    case 2:
      view.camera = StereoCalibration{};
      break;
    case 3:
      view.camera = SessionNumber{which};
      break;
    default:
      break;
  }
  return view;
}

RouteEnd end_of(ByteReader& in) {
  switch (in.get<std::uint8_t>() % 4) {
    case 0:
      return FrameId{in.get<std::uint32_t>(), in.get<std::uint32_t>()};
    case 1:
      return std::string(fuzzing::text_of(fuzzing::take_up_to(in, 5)));
    case 2:
      return view_of(in);
    default:
      return Robot{"cart"};
  }
}

void ask(ByteReader in) {
  RouteRequest asked{end_of(in), end_of(in)};
  const auto how = in.get<std::uint8_t>();
  if ((how & 1u) != 0) asked.weights = RouteWeights{in.get<double>(), in.get<double>(), 0, 0};
  if ((how & 2u) != 0) asked.or_from = {end_of(in)};
  if ((how & 4u) != 0) asked.or_to = {end_of(in)};
  asked.alternatives = how % 6;
  asked.filter = {{how}, {FrameId{how, 1}}, {"hall"}, how, (how & 8u) != 0, (how & 16u) != 0, (how & 32u) != 0};
  const auto is_text = [](const RouteEnd& end) {
    const auto* label = std::get_if<std::string>(&end);
    return !label || is_utf8(*label);
  };
  for (const auto* ends : {&asked.or_from, &asked.or_to})
    if (!std::all_of(ends->begin(), ends->end(), is_text)) return;
  if (!is_text(asked.from) || !is_text(asked.to)) return;  // the daemon cannot read it, and says so
  const v1::FindRouteRequest request = route_message(asked);
  v1::FindRouteRequest read;
  must(read.ParseFromString(request.SerializePartialAsString()));
  must(read.or_from_size() == static_cast<int>(asked.or_from.size()) &&
       read.has_weights() == asked.weights.has_value());
  must(read.filter().no_long_loops() != asked.filter.long_loops);
  must(read.alternatives() == asked.alternatives);
}

void list(ByteReader in) {
  EdgeFilter filter;
  const auto how = in.get<std::uint8_t>();
  if ((how & 1u) != 0) filter.region = Region{{how, in.get<std::uint32_t>()}, how, in.get<double>()};
  filter.order = static_cast<EdgeOrder>(1 + how % 3);
  filter.from_us = in.get<std::int64_t>();
  filter.limit = in.get<std::uint32_t>();
  filter.min_suspicion = in.get<double>();
  v1::ListEdgesRequest read;
  must(read.ParseFromString(edges_message(filter).SerializeAsString()));
  must(read.has_region() == filter.region.has_value() && read.from_us() == filter.from_us);
  must(read.page_size() <= 5000);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const ByteSpan bytes(data + 1, size - 1);
  switch (data[0] % 19) {
    case 0:
      read_as(bytes, read_edge);
      break;
    case 1:
      read_as(bytes, read_effect);
      break;
    case 2:
      read_as(bytes, read_exported);
      break;
    case 3:
      read_as(bytes, read_frame);
      break;
    case 4:
      read_as(bytes, read_session);
      break;
    case 5:
      read_as(bytes, read_localisation);
      break;
    case 6:
      read_as(bytes, read_matches);
      break;
    case 7: {
      v1::FindRouteReply message;
      Route route;
      if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) break;
      const Status read = read_route_reply(message, route);
      must(read.ok() || read.reason() == Reason::CORRUPT);
      must(route.alternatives.size() <= 1);
      break;
    }
    case 8:
      read_as(bytes, read_explanation);
      break;
    case 9:
      read_as(bytes, read_transform);
      break;
    case 10:
      read_as(bytes, read_status);
      break;
    case 11:
      read_as(bytes, read_robot);
      break;
    case 12:
      read_as(bytes, read_cell);
      break;
    case 13:
      read_as(bytes, read_audit);
      break;
    case 14:
      list(ByteReader(bytes));
      break;
    case 15:
      ask(ByteReader(bytes));
      break;
    case 16: {
      v1::MapEvent message;
      if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) break;
      const auto read = read_event(message);
      check(read);
      if (!read.ok() || !*read) break;
      if (std::holds_alternative<SessionChanged>((*read)->what))
        must(v1::SessionState_IsValid(message.session_changed().state()));
      if (std::holds_alternative<FramesAdded>((*read)->what))
        for (const v1::AddedFrame& frame : message.frames_added().frames())
          must(v1::MotionSource_IsValid(frame.source()));
      break;
    }
    case 18:
      read_as(bytes, read_neighbourhood);
      break;
    default: {
      v1::GetSkeletonReply message;
      Skeleton skeleton;
      if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) break;
      for (int times = 0; times < 2; ++times) {
        const Status read = read_skeleton_part(message, skeleton);
        must(read.ok() || read.reason() == Reason::CORRUPT);
        for (const Skeleton::Chain& chain : skeleton.chains) must(!chain.points.empty());
      }
    }
  }
  return 0;
}
