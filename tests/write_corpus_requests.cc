// What rpc_request_fuzz starts from: requests of all methods that mean something in its small map, in which session 1
// has 50 frames, of which the last ten come back to where the first were, session 2 has six elsewhere, and session 3
// has five where session 1 began.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "proto/base/crc32c.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "tests/write_corpus.h"

namespace relmap::testing {

namespace {

// Stands for what an earlier answer of the same input said: a token, and the mark of what an edit would remove.
constexpr char kHeard[] = "?";
constexpr std::uint64_t kShown = 1;

// The number that the fuzzer gives a method: those of Map, Ingest and Admin, in their order.
std::uint8_t number_of(const std::string& name) {
  std::uint8_t number = 0;
  for (const auto* file : {v1::LocaliseRequest::descriptor()->file(), v1::IngestRequest::descriptor()->file(),
                           v1::VerifyRequest::descriptor()->file()})
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m, ++number)
        if (file->service(s)->method(m)->name() == name) return number;
  throw std::runtime_error("no method " + name);
}

class Calls {
 public:
  template <typename... Messages>
  Calls& call(const std::string& method, const Messages&... messages) {
    return whole_messages(0, method, messages...);
  }
  // The daemon has answered what is streamed before the stream ends; or the caller leaves after the first answer.
  template <typename... Messages>
  Calls& call_otherwise(const std::string& method, const Messages&... messages) {
    return whole_messages(64, method, messages...);
  }
  // Fields are set one by one, as the fuzzer reads them from bytes; it knows keyframes and views of the map.
  // `settled`: the daemon has done what the messages of a stream ask of it before the stream ends.
  Calls& fields(const std::string& method, int messages, std::initializer_list<int> bytes, bool settled = false) {
    constexpr int kSettled = 192;
    w_.put(number_of(method));
    w_.put(static_cast<std::uint8_t>((settled ? kSettled : 0) + 2 * messages));
    for (const int byte : bytes) w_.put(static_cast<std::uint8_t>(byte));
    return *this;
  }
  const Bytes& bytes() const { return w_.bytes(); }

 private:
  template <typename... Messages>
  Calls& whole_messages(std::size_t manner, const std::string& method, const Messages&... messages) {
    constexpr std::size_t kWholeMessages = 129;
    w_.put(number_of(method));
    w_.put(static_cast<std::uint8_t>(kWholeMessages + manner + 2 * sizeof...(messages)));
    const auto put = [&](const google::protobuf::Message& message) {
      const std::string bytes = message.SerializeAsString();
      w_.put(static_cast<std::uint16_t>(bytes.size()));
      w_.put_bytes(as_bytes(bytes));
    };
    (put(messages), ...);
    return *this;
  }

  ByteWriter w_;
};

template <typename Message>
Message with(auto set) {
  Message message;
  set(message);
  return message;
}

v1::FrameId frame(std::uint32_t session, std::uint32_t index) { return to_wire(FrameId{session, index}); }

v1::RouteEnd end_at(std::uint32_t session, std::uint32_t index) {
  v1::RouteEnd end;
  *end.mutable_frame() = frame(session, index);
  return end;
}

v1::FindRouteRequest route(std::uint32_t from, std::uint32_t to, auto set) {
  v1::FindRouteRequest request;
  *request.mutable_from() = end_at(1, from);
  *request.mutable_to() = end_at(1, to);
  set(request);
  return request;
}
v1::FindRouteRequest route(std::uint32_t from, std::uint32_t to) {
  return route(from, to, [](v1::FindRouteRequest&) {});
}

v1::Camera camera_of_map() { return to_wire(StereoCamera{400, 256, 192, 0.12, 512, 384}); }

void add_places(const Corpus& corpus, const Bytes& jpeg) {
  const std::string picture(jpeg.begin(), jpeg.end());
  const auto add = [&](const std::string& name, auto set) {
    v1::LocaliseRequest localise;
    set(*localise.mutable_view());
    v1::MatchImageRequest match;
    *match.mutable_view() = localise.view();
    match.set_max_places(3);
    match.set_max_verified(2);
    match.set_thumbnails(true);
    *match.mutable_near() = frame(1, 44);
    *localise.mutable_prior() = frame(1, 44);
    corpus.add("place_" + name, {}, Calls().call("Localise", localise).call("MatchImage", match).bytes());
  };
  add("of_frame", [](v1::View& v) { *v.mutable_frame() = frame(1, 45); });
  add("of_frame_elsewhere", [](v1::View& v) { *v.mutable_frame() = frame(2, 3); });
  add("of_no_frame", [](v1::View& v) { *v.mutable_frame() = frame(7, 45); });
  add("of_frame_with_camera", [](v1::View& v) {
    *v.mutable_frame() = frame(1, 45);
    *v.mutable_camera() = camera_of_map();
  });
  add("of_nothing", [](v1::View&) {});
  add("of_picture", [&](v1::View& v) { v.mutable_left()->set_data(picture); });
  add("of_picture_and_camera", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    *v.mutable_camera() = camera_of_map();
    v.set_supposed(true);
  });
  add("of_pair", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.mutable_right()->set_data(picture);
    v.set_session(1);
    v.set_rectified(true);
  });
  add("of_either_eye", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.set_session(1);
    v.set_either_eye(true);
  });
  add("of_pair_before_rectification", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.mutable_right()->set_data(picture);
    auto& raw = *v.mutable_raw();
    raw.set_width(640);
    raw.set_height(480);
    for (auto* eye : {raw.mutable_left(), raw.mutable_right()}) {
      eye->set_fx(500);
      eye->set_fy(501);
      eye->set_cx(320);
      eye->set_cy(240);
    }
    raw.mutable_right_from_left()->mutable_rotation()->set_w(1);
    raw.mutable_right_from_left()->mutable_translation()->set_x(-0.2);
  });
  add("of_no_picture", [](v1::View& v) { v.mutable_left()->set_data("text"); });
  add("rectified_without_session", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.set_rectified(true);
  });
  add("either_eye_without_session", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.set_either_eye(true);
  });
  add("of_no_session", [&](v1::View& v) {
    v.mutable_left()->set_data(picture);
    v.set_session(9);
  });
  for (const int which : {2, 3})  // features with a camera, or of a session
    for (const int index : {3, 45})
      corpus.add("place_of_features_" + std::to_string(which) + "_" + std::to_string(index), {},
                 Calls()
                     .fields("Localise", 1, {0, 4 * index + which, 31})
                     .fields("MatchImage", 1, {0, 4 * index + which, 1, 2, 2, 3, 3, 1, 31})
                     .bytes());
}

void add_routes(const Corpus& corpus) {
  const auto add = [&](const std::string& name, const v1::FindRouteRequest& request) {
    corpus.add("route_" + name, {}, Calls().call("FindRoute", request).bytes());
  };
  add("by_default", route(0, 45));
  add("back", route(45, 0));
  add("to_itself", route(7, 7));
  add("to_no_frame", route(7, 99));
  for (const auto by : {v1::ROUTE_BY_DISTANCE, v1::ROUTE_BY_TIME, v1::ROUTE_BY_CERTAINTY})
    add("by_" + std::to_string(by), route(2, 48, [&](v1::FindRouteRequest& r) {
          r.set_by(by);
          r.set_count_standing(true);
          r.set_covariance(true);
        }));
  add("by_unknown", route(2, 48, [](v1::FindRouteRequest& r) { r.set_by(static_cast<v1::RouteBy>(9)); }));
  add("by_weights", route(2, 48, [](v1::FindRouteRequest& r) {
        r.mutable_weights()->set_metre(1);
        r.mutable_weights()->set_driven_second(0.5);
        r.mutable_weights()->set_square_metre_of_variance(2);
      }));
  add("by_no_weights", route(2, 48, [](v1::FindRouteRequest& r) { r.mutable_weights(); }));
  add("by_weights_and_standing", route(2, 48, [](v1::FindRouteRequest& r) {
        r.mutable_weights()->set_metre(1);
        r.set_count_standing(true);
      }));
  add("with_limit", route(0, 20, [](v1::FindRouteRequest& r) { r.set_max_cost(0.5); }));
  add("with_bad_limit", route(0, 20, [](v1::FindRouteRequest& r) { r.set_max_cost(-1); }));
  add("with_filter", route(0, 48, [](v1::FindRouteRequest& r) {
        auto& filter = *r.mutable_filter();
        filter.add_sessions(1);
        *filter.add_avoid_frames() = frame(1, 20);
        filter.set_min_support(1);
        filter.set_suppose_candidates(true);
        filter.set_suppose_quarantined(true);
      }));
  add("without_long_loops", route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_filter()->set_no_long_loops(true); }));
  add("of_no_session", route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_filter()->add_sessions(9); }));
  add("avoiding_no_frame",
      route(0, 48, [](v1::FindRouteRequest& r) { *r.mutable_filter()->add_avoid_frames() = frame(9, 20); }));
  add("avoiding_no_label",
      route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_filter()->add_avoid_labels("nowhere"); }));
  add("that_nothing_connects", route(0, 48, [](v1::FindRouteRequest& r) { *r.mutable_to() = end_at(2, 3); }));
  add("from_several_to_several", route(0, 48, [](v1::FindRouteRequest& r) {
        *r.add_or_from() = end_at(2, 1);
        *r.add_or_to() = end_at(2, 3);
        *r.add_or_to() = end_at(1, 30);
      }));
  add("to_robot", route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_to()->set_robot("points"); }));
  add("to_no_robot", route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_to()->set_robot("nobody"); }));
  add("to_view",
      route(0, 48, [](v1::FindRouteRequest& r) { *r.mutable_to()->mutable_view()->mutable_frame() = frame(1, 45); }));
  add("from_view",
      route(0, 48, [](v1::FindRouteRequest& r) { *r.mutable_from()->mutable_view()->mutable_frame() = frame(1, 45); }));
  add("from_nowhere", route(0, 48, [](v1::FindRouteRequest& r) { r.clear_from(); }));
  add("with_bad_token", route(0, 48, [](v1::FindRouteRequest& r) { r.set_resume_token("x"); }));
  const auto label = with<v1::SetLabelRequest>([](v1::SetLabelRequest& r) {
    *r.mutable_frame() = frame(1, 30);
    r.set_label("hall");
  });
  corpus.add("route_to_label", {},
             Calls()
                 .call("SetLabel", label)
                 .call("FindRoute", route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_to()->set_label("hall"); }))
                 .call("FindRoute",
                       route(0, 48, [](v1::FindRouteRequest& r) { r.mutable_filter()->add_avoid_labels("hall"); }))
                 .bytes());
  corpus.add("route_resumed", {},
             Calls()
                 .call_otherwise("FindRoute", route(0, 25))
                 .call("FindRoute", route(0, 25, [](v1::FindRouteRequest& r) { r.set_resume_token(kHeard); }))
                 .call("FindRoute", route(1, 25, [](v1::FindRouteRequest& r) { r.set_resume_token(kHeard); }))
                 .bytes());
  const auto between = [](std::uint32_t a, std::uint32_t session, std::uint32_t b) {
    return with<v1::TransformBetweenRequest>([&](v1::TransformBetweenRequest& r) {
      *r.mutable_a() = frame(1, a);
      *r.mutable_b() = frame(session, b);
    });
  };
  corpus.add("transform_between", {},
             Calls()
                 .call("TransformBetween", between(0, 1, 45))
                 .call("TransformBetween", between(5, 1, 5))
                 .call("TransformBetween", between(5, 2, 3))
                 .call("TransformBetween", between(5, 9, 3))
                 .bytes());
}

void add_lists(const Corpus& corpus) {
  const auto sessions = [](std::uint32_t size, const char* token) {
    return with<v1::ListSessionsRequest>([&](v1::ListSessionsRequest& r) {
      r.set_page_size(size);
      r.set_page_token(token);
    });
  };
  corpus.add("list_sessions", {},
             Calls()
                 .call("ListSessions", sessions(1, ""))
                 .call("ListSessions", sessions(1, kHeard))
                 .call("ListSessions", sessions(0, ""))
                 .call("ListSessions", sessions(1, "x"))
                 .bytes());
  const auto edges = [](auto set) { return with<v1::ListEdgesRequest>(set); };
  corpus.add("list_edges", {},
             Calls()
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_page_size(7); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) {
                         r.set_page_size(7);
                         r.set_page_token(kHeard);
                       }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) {
                         r.add_states(v1::EDGE_STATE_ACCEPTED);
                         r.add_kinds(v1::EDGE_KIND_LOOP);
                         r.set_session(1);
                       }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { *r.mutable_frame() = frame(1, 45); }))
                 .bytes());
  corpus.add("list_edges_of_nothing", {},
             Calls()
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.add_states(static_cast<v1::EdgeState>(9)); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_session(9); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { *r.mutable_frame() = frame(9, 45); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_page_token("x"); }))
                 .bytes());
  const auto label = [](std::uint32_t index, const char* text, bool remove) {
    return with<v1::SetLabelRequest>([&](v1::SetLabelRequest& r) {
      *r.mutable_frame() = frame(1, index);
      r.set_label(text);
      r.set_remove(remove);
      r.set_idempotency_key("once");
    });
  };
  const auto labels = [](auto set) { return with<v1::FindLabelsRequest>(set); };
  corpus.add("labels", {},
             Calls()
                 .call("SetLabel", label(3, "Hall north", false))
                 .call("SetLabel", label(3, "Hall north", false))
                 .call("FindLabels", labels([](v1::FindLabelsRequest& r) { r.set_prefix("hall"); }))
                 .call("FindLabels", labels([](v1::FindLabelsRequest& r) { r.set_words("north"); }))
                 .bytes());
  corpus.add("labels_in_pages", {},
             Calls()
                 .call("SetLabel", with<v1::SetLabelRequest>([](v1::SetLabelRequest& r) {
                         *r.mutable_frame() = frame(1, 1);
                         r.set_label("a");
                       }))
                 .call("SetLabel", with<v1::SetLabelRequest>([](v1::SetLabelRequest& r) {
                         *r.mutable_frame() = frame(1, 2);
                         r.set_label("b");
                       }))
                 .call("FindLabels", labels([](v1::FindLabelsRequest& r) { r.set_page_size(1); }))
                 .call("FindLabels", labels([](v1::FindLabelsRequest& r) {
                         r.set_page_size(1);
                         r.set_page_token(kHeard);
                       }))
                 .bytes());
  corpus.add("labels_removed", {},
             Calls()
                 .call("SetLabel", label(3, "hall", false))
                 .call("SetLabel", with<v1::SetLabelRequest>([](v1::SetLabelRequest& r) {
                         *r.mutable_frame() = frame(1, 3);
                         r.set_label("hall");
                         r.set_remove(true);
                       }))
                 .call("SetLabel", label(3, "other", false))  // of the same key
                 .call("SetLabel", label(99, "x", true))
                 .bytes());
  const auto around = [](auto set) { return with<v1::GetNeighbourhoodRequest>(set); };
  corpus.add(
      "neighbourhood", {},
      Calls()
          .call("GetNeighbourhood", around([](v1::GetNeighbourhoodRequest& r) {
                  *r.mutable_root() = frame(1, 20);
                  r.set_landmarks(true);
                }))
          .call("GetNeighbourhood", around([](v1::GetNeighbourhoodRequest& r) {
                  *r.mutable_root() = frame(1, 20);
                  r.set_max_edges(3);
                  r.set_max_metres(0.5);
                  r.set_max_frames(2);
                }))
          .call("GetNeighbourhood", around([](v1::GetNeighbourhoodRequest& r) {
                  *r.mutable_root() = frame(1, 20);
                  r.set_max_metres(-1);
                }))
          .call("GetNeighbourhood", around([](v1::GetNeighbourhoodRequest& r) { *r.mutable_root() = frame(9, 9); }))
          .bytes());
  const auto one = [](std::uint32_t session, std::uint32_t index) {
    return with<v1::GetFrameRequest>([&](v1::GetFrameRequest& r) {
      *r.mutable_frame() = frame(session, index);
      r.set_landmarks(true);
      r.set_observations(true);
      r.set_appearance(true);
      r.set_thumbnail(true);
    });
  };
  corpus.add("frames", {},
             Calls()
                 .call("GetFrame", one(1, 45))
                 .call("GetFrame", one(2, 3))
                 .call("GetFrame", one(9, 3))
                 .call("GetFrame", v1::GetFrameRequest())
                 .bytes());
  corpus.add("status", {},
             Calls()
                 .call("GetStatus", v1::GetStatusRequest())
                 .call("ListRobots", v1::ListRobotsRequest())
                 .call("GetStats", v1::GetStatsRequest())
                 .call("WaitIdle", v1::WaitIdleRequest())
                 .bytes());
  const auto exported = [](auto set) { return with<v1::ExportRequest>(set); };
  for (const auto format :
       {v1::EXPORT_FORMAT_UNSPECIFIED, v1::EXPORT_FORMAT_TUM, v1::EXPORT_FORMAT_KITTI, v1::EXPORT_FORMAT_FRAMES})
    corpus.add("export_" + std::to_string(format), {},
               Calls()
                   .call("Export", exported([&](v1::ExportRequest& r) {
                           r.set_format(format);
                           r.set_landmarks(format == v1::EXPORT_FORMAT_FRAMES);
                         }))
                   .call("Export", exported([&](v1::ExportRequest& r) {
                           r.set_format(format);
                           r.add_sessions(2);
                         }))
                   .call("Export", exported([&](v1::ExportRequest& r) {
                           r.set_format(format);
                           r.set_resume_token(kHeard);
                         }))
                   .call("Export", exported([&](v1::ExportRequest& r) {
                           r.set_format(format);
                           r.add_sessions(9);
                         }))
                   .bytes());
  corpus.add("export_bad", {},
             Calls()
                 .call("Export", exported([](v1::ExportRequest& r) { r.set_resume_token("x"); }))
                 .call("Export", exported([](v1::ExportRequest& r) { r.set_format(static_cast<v1::ExportFormat>(9)); }))
                 .call("Export", exported([](v1::ExportRequest& r) {
                         r.set_format(v1::EXPORT_FORMAT_TUM);
                         r.set_landmarks(true);
                       }))
                 .bytes());
}

void add_edits(const Corpus& corpus) {
  // Every edge that the fuzzer knows, by its number there: closures come late among them.
  for (int edge = 40; edge < 64; edge += 2) {
    const int known = 4 * edge + 1;
    constexpr int kEdge = 0, kState = 1, kAlone = 6, kDryRun = 5, kDecided = 4, kMark = 7, kEnd = 31;
    constexpr int kRemoved = 4 + 2, kAccepted = 2 + 2, kNumberOfShown = 11;
    corpus.add("edge_" + std::to_string(edge), {},
               Calls()
                   .fields("SetEdgeState", 1, {kEdge, known, kState, kRemoved, kDryRun, 1, kEnd})
                   .fields("SetEdgeState", 1, {kEdge, known, kState, kRemoved, kMark, kNumberOfShown, kEnd})
                   .fields("SetEdgeState", 1, {kEdge, known, kState, kAccepted, kDecided, 1, kEnd})
                   .fields("SetEdgeState", 1, {kEdge, known, kState, kRemoved, kAlone, 1, kEnd})
                   .bytes());
  }
  const auto edit = [](auto set) {
    return with<v1::SetEdgeStateRequest>([&](v1::SetEdgeStateRequest& r) {
      *r.mutable_edge() = to_wire(EdgeId{{1, 5}, 0});
      r.set_state(v1::EDGE_STATE_REMOVED);
      set(r);
    });
  };
  corpus.add("edges_refused", {},
             Calls()
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest&) {}))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) { r.set_state(v1::EDGE_STATE_CANDIDATE); }))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) { r.clear_edge(); }))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) { r.set_note(std::string(70000, 'x')); }))
                 .bytes());
  corpus.add("edges_contradict", {},
             Calls()
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) { r.set_decided(true); }))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) {
                         r.set_state(v1::EDGE_STATE_ACCEPTED);
                         r.set_alone(true);
                       }))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) { r.set_shown(kShown + 1); }))
                 .call("SetEdgeState", edit([](v1::SetEdgeStateRequest& r) {
                         *r.mutable_edge() = to_wire(EdgeId{{9, 9}, 9});
                       }))
                 .bytes());
  const auto proposal = [](std::uint32_t a, std::uint32_t session, std::uint32_t b, auto set) {
    return with<v1::ProposeEdgeRequest>([&](v1::ProposeEdgeRequest& r) {
      *r.mutable_a() = frame(1, a);
      *r.mutable_b() = frame(session, b);
      set(r);
    });
  };
  const auto as_it_is = [](v1::ProposeEdgeRequest&) {};
  corpus.add("closure_of_one_drive", {}, Calls().call("ProposeEdge", proposal(20, 1, 24, as_it_is)).bytes());
  // Session 3 saw what session 1 did where both began, and no closure says so yet.
  const auto dry = [](v1::ProposeEdgeRequest& r) { r.set_dry_run(true); };
  const auto accepted = [](v1::ProposeEdgeRequest& r) {
    r.set_accept(true);
    r.set_note("seen");
    r.set_idempotency_key("once");
  };
  corpus.add("closure_tried", {},
             Calls()
                 .call("ProposeEdge", proposal(1, 3, 1, dry))
                 .call("ProposeEdge", proposal(2, 3, 2,
                                               [](v1::ProposeEdgeRequest& r) {
                                                 r.set_dry_run(true);
                                                 r.set_accept(true);
                                                 r.set_note("seen");
                                               }))
                 .call("ProposeEdge", proposal(1, 3, 1, as_it_is))
                 .call("ProposeEdge", proposal(1, 3, 1, as_it_is))
                 .bytes());
  corpus.add("closure_accepted", {},
             Calls()
                 .call("ProposeEdge", proposal(2, 3, 2, accepted))
                 .call("ProposeEdge", proposal(2, 3, 2, accepted))
                 .call("ProposeEdge", proposal(3, 3, 3, accepted))  // of the same key
                 .call("ListEdges", with<v1::ListEdgesRequest>([](v1::ListEdgesRequest& r) { r.set_session(3); }))
                 .bytes());
  corpus.add("closure_refused", {},
             Calls()
                 .call("ProposeEdge", proposal(3, 1, 3, as_it_is))
                 .call("ProposeEdge", proposal(3, 2, 3, as_it_is))
                 .call("ProposeEdge", proposal(3, 9, 3, as_it_is))
                 .call("ProposeEdge", proposal(3, 1, 43, [](v1::ProposeEdgeRequest& r) { r.set_note("not accepted"); }))
                 .bytes());
  corpus.add("closure_of_neighbours", {}, Calls().call("ProposeEdge", proposal(3, 1, 4, as_it_is)).bytes());

  const auto graph = [](auto set) {
    return with<v1::ImportGraphRequest>([&](v1::ImportGraphRequest& r) {
      Uuid uuid;
      uuid.bytes[3] = 77;
      r.set_session_uuid(uuid_to_wire(uuid));
      r.set_robot("importer");
      r.set_name("graph");
      for (std::uint32_t i = 0; i < 4; ++i) {
        auto& added = *r.add_frames();
        SE3 T;
        T.t.x() = i;
        *added.mutable_odom_from_frame() = to_wire(T);
        if (i != 2) *added.mutable_step() = to_wire(Matrix6(0.01 * Matrix6::Identity()));
        added.set_time_us(1'000'000 * (i + 1));
        added.set_driven_us(500'000);
      }
      auto& loop = *r.add_loops();
      loop.set_query(3);
      loop.set_match(0);
      *loop.mutable_match_from_query() = to_wire(SE3());
      *loop.mutable_covariance() = to_wire(Matrix6(0.01 * Matrix6::Identity()));
      set(r);
    });
  };
  const auto whole = [](v1::ImportGraphRequest&) {};
  corpus.add("import", {},
             Calls()
                 .call("ImportGraph", graph(whole))
                 .call("ImportGraph", graph(whole))  // again
                 .call("ImportGraph", graph([](v1::ImportGraphRequest& r) {
                         r.set_first(4);
                         for (int i = 0; i < 4; ++i)
                           r.mutable_frames(i)->set_time_us(9'000'000 + r.frames(i).time_us());
                         r.mutable_loops(0)->set_query(7);
                       }))
                 .call("ImportGraph", graph([](v1::ImportGraphRequest& r) { r.set_first(90); }))
                 .bytes());
  const auto bad = [&](const std::string& name, auto set) {
    corpus.add("import_" + name, {}, Calls().call("ImportGraph", graph(set)).bytes());
  };
  bad("of_no_uuid", [](v1::ImportGraphRequest& r) { r.set_session_uuid("x"); });
  bad("of_no_robot", [](v1::ImportGraphRequest& r) { r.clear_robot(); });
  bad("without_frames", [](v1::ImportGraphRequest& r) { r.clear_frames(); });
  bad("time_backwards", [](v1::ImportGraphRequest& r) { r.mutable_frames(2)->set_time_us(5); });
  bad("time_of_the_future", [](v1::ImportGraphRequest& r) { r.mutable_frames(3)->set_time_us(~std::uint64_t{0}); });
  bad("no_rotation",
      [](v1::ImportGraphRequest& r) { r.mutable_frames(2)->mutable_odom_from_frame()->clear_rotation(); });
  bad("bad_step", [](v1::ImportGraphRequest& r) { r.mutable_frames(1)->mutable_step()->clear_upper(); });
  bad("bad_loop", [](v1::ImportGraphRequest& r) { r.mutable_loops(0)->mutable_covariance()->clear_upper(); });
  bad("loop_without_transform", [](v1::ImportGraphRequest& r) { r.mutable_loops(0)->clear_match_from_query(); });
  bad("loop_of_no_frame", [](v1::ImportGraphRequest& r) { r.mutable_loops(0)->set_query(70); });
  bad("loop_backwards", [](v1::ImportGraphRequest& r) { r.mutable_loops(0)->set_match(3); });
}

void add_ingest(const Corpus& corpus) {
  // Hello, keyframes of a new session or of the map's, gap, end: content, which of those that the fuzzer knows, end.
  constexpr int kHello = 0, kKeyframe = 1, kKnown = 1, kNew = 2, kLater = 3, kEnd = 31;
  corpus.add(
      "stream_of_new_session", {},
      Calls()
          .fields("Stream", 4,
                  {kHello, kKnown, kEnd, kKeyframe, kNew, kEnd, kKeyframe, 4 + kNew, kEnd, kKeyframe, 8 + kNew, kEnd})
          .call("ListRobots", v1::ListRobotsRequest())
          .call("GetStatus", v1::GetStatusRequest())
          .bytes());
  corpus.add("stream_that_is_localised", {},
             Calls()
                 .fields("Stream", 5,
                         {kHello, kKnown, kEnd, kKeyframe, kNew, kEnd, kKeyframe, 4 + kNew, kEnd, kKeyframe, 8 + kNew,
                          kEnd, kKeyframe, 12 + kNew, kEnd},
                         true)
                 .call("ListSessions", v1::ListSessionsRequest())
                 .bytes());
  corpus.add("stream_of_known_session", {},
             Calls()
                 .fields("Stream", 4,
                         {kHello, kKnown, kEnd, kKeyframe, kKnown, kEnd, kKeyframe, 4 + kLater, kEnd, kKeyframe,
                          200 + kKnown, kEnd})
                 .bytes());
  corpus.add("stream_without_hello", {},
             Calls().fields("Stream", 2, {kKeyframe, kNew, kEnd, kHello, kKnown, kEnd}).bytes());
  corpus.add("stream_two_hellos", {},
             Calls().fields("Stream", 2, {kHello, kKnown, kEnd, kHello, kKnown, kEnd}).bytes());

  const SessionUuid known{{0x72, 0x65, 0x6c, 0x6d, 0x61, 0x70, 0x20, 0x70, 0x6f, 0x69, 0x6e, 0x74, 0x73, 0, 0, 1}};
  const auto request = [](auto set) { return with<v1::IngestRequest>(set); };
  const auto hello = request([](v1::IngestRequest& r) {
    r.mutable_hello()->mutable_protocol()->set_major(1);
    r.mutable_hello()->set_robot("points");
  });
  const auto gap = [&](const std::string& session, std::uint32_t first, std::uint32_t last, v1::Reason reason) {
    return request([&](v1::IngestRequest& r) {
      r.mutable_gap()->set_session_uuid(session);
      r.mutable_gap()->set_first(first);
      r.mutable_gap()->set_last(last);
      r.mutable_gap()->set_reason(reason);
    });
  };
  const auto end = [&](const std::string& session, std::uint64_t next) {
    return request([&](v1::IngestRequest& r) {
      r.mutable_end()->set_session_uuid(session);
      r.mutable_end()->set_next_sequence(next);
    });
  };
  const std::string uuid = uuid_to_wire(known);
  const auto add = [&](const std::string& name, const auto&... messages) {
    corpus.add("stream_" + name, {}, Calls().call("Stream", messages...).bytes());
    corpus.add("answered_stream_" + name, {}, Calls().call_otherwise("Stream", messages...).bytes());
  };
  add("gap_and_end", hello, gap(uuid, 50, 52, v1::REASON_DROPPED_BY_ROBOT), end(uuid, 53));
  add("gap_backwards", hello, gap(uuid, 60, 52, v1::REASON_DROPPED_BY_ROBOT));
  add("gap_of_no_reason", hello, gap(uuid, 50, 52, v1::REASON_CORRUPT));
  add("gap_of_no_session", hello, gap("x", 50, 52, v1::REASON_DROPPED_BY_ROBOT));
  add("gap_too_long", hello, gap(uuid, 50, 0xfffffff0, v1::REASON_CAPTURE_FAILED));
  add("end_of_no_session", hello, end("x", 3));
  add("end_too_far", hello, end(uuid, ~std::uint64_t{0}));
  add("nothing", v1::IngestRequest());
  add("hello_and_nothing", hello, v1::IngestRequest());
  add("of_another_protocol", request([](v1::IngestRequest& r) {
        r.mutable_hello()->mutable_protocol()->set_major(9);
        r.mutable_hello()->set_robot("points");
      }));
  add("of_no_robot", request([](v1::IngestRequest& r) { r.mutable_hello()->mutable_protocol()->set_major(1); }));
  const auto keyframe = [&](const std::string& session, std::uint32_t crc, const std::string& payload) {
    return request([&](v1::IngestRequest& r) {
      r.mutable_keyframe()->set_session_uuid(session);
      r.mutable_keyframe()->set_sequence(50);
      r.mutable_keyframe()->set_crc32c(crc);
      r.mutable_keyframe()->set_payload(payload);
    });
  };
  add("keyframe_of_no_session", hello, keyframe("x", 0, "payload"));
  add("keyframe_of_another_checksum", hello, keyframe(uuid, 1, "payload"));
  add("keyframe_that_is_none", hello, keyframe(uuid, crc32c(as_bytes("payload")), "payload"));
  add("keyframe_of_nothing", hello, keyframe(uuid, 0, ""));
  const auto asked = [](const std::string& session) {
    return with<v1::GetAcknowledgementRequest>([&](v1::GetAcknowledgementRequest& r) { r.set_session_uuid(session); });
  };
  corpus.add("acknowledgements", {},
             Calls()
                 .call("Stream", hello, gap(uuid, 55, 56, v1::REASON_DROPPED_BY_ROBOT))
                 .call("GetAcknowledgement", asked(uuid))
                 .call("GetAcknowledgement", asked(uuid_to_wire(SessionUuid{{9}})))
                 .call("GetAcknowledgement", asked("x"))
                 .bytes());
}

void add_admin(const Corpus& corpus) {
  corpus.add("verify", {},
             Calls()
                 .call("Verify", v1::VerifyRequest())
                 .call("Verify", with<v1::VerifyRequest>([](v1::VerifyRequest& r) { r.add_sessions(2); }))
                 .call("Verify", with<v1::VerifyRequest>([](v1::VerifyRequest& r) { r.add_sessions(9); }))
                 .call("Repair", with<v1::RepairRequest>([](v1::RepairRequest& r) { r.add_sessions(1); }))
                 .bytes());
  const auto backup = [](const std::string& folder) {
    return with<v1::BackupRequest>([&](v1::BackupRequest& r) { r.set_folder(folder); });
  };
  corpus.add("backup", {},
             Calls()
                 .call("Backup", backup("/nowhere/backups/one"))
                 .call("Backup", backup("/nowhere/else"))
                 .call("Backup", backup("relative"))
                 .call("Backup", backup(""))
                 .bytes());
  corpus.add("maintain", {},
             Calls()
                 .call("Compact", v1::CompactRequest())
                 .call("Commit", v1::CommitRequest())
                 .call("Reindex", with<v1::ReindexRequest>([](v1::ReindexRequest& r) { r.set_vocabulary("/nowhere"); }))
                 .call("Repair", v1::RepairRequest())
                 .bytes());
  const auto freeze = [](std::uint32_t session, bool frozen) {
    return with<v1::FreezeSessionRequest>([&](v1::FreezeSessionRequest& r) {
      r.set_session(session);
      r.set_frozen(frozen);
      r.set_idempotency_key(frozen ? "freeze" : "thaw");
    });
  };
  corpus.add("freeze", {},
             Calls()
                 .call("FreezeSession", freeze(1, true))
                 .call("FreezeSession", freeze(1, true))
                 .call("FreezeSession", freeze(1, false))
                 .call("FreezeSession", freeze(9, true))
                 .bytes());
  const auto removal = [](std::uint32_t session, const std::string& uuid) {
    return with<v1::DeleteSessionRequest>([&](v1::DeleteSessionRequest& r) {
      r.set_session(session);
      r.set_uuid(uuid);
    });
  };
  const std::string second =
      Uuid{{0x72, 0x65, 0x6c, 0x6d, 0x61, 0x70, 0x20, 0x70, 0x6f, 0x69, 0x6e, 0x74, 0x73, 0, 0, 2}}.to_string();
  corpus.add("delete", {},
             Calls()
                 .call("DeleteSession", removal(2, "x"))
                 .call("DeleteSession", removal(1, second))
                 .call("DeleteSession", removal(2, second))
                 .call("DeleteSession", removal(9, second))
                 .bytes());
}

}  // namespace

void write_known_requests(const std::string& root) {
  const Corpus corpus(root, "rpc_request_fuzz");
  add_places(corpus, fuzzing::read_file(root + "/picture_fuzz/grey.jpg"));
  add_routes(corpus);
  add_lists(corpus);
  add_edits(corpus);
  add_ingest(corpus);
  add_admin(corpus);
}

}  // namespace relmap::testing
