// Requests that read: places, routes, and lists of what the map has.
#include "tests/write_corpus_calls.h"

namespace relmap::testing {

namespace {

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
  add("with_alternatives", route(0, 25, [](v1::FindRouteRequest& r) {
        r.set_alternatives(5);
        r.set_covariance(true);
      }));
  add("with_too_many_alternatives", route(0, 25, [](v1::FindRouteRequest& r) { r.set_alternatives(6); }));
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
  corpus.add("list_edges_filtered", {},
             Calls()
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) {
                         r.set_session(1);
                         r.set_other_session(3);
                         r.set_from_us(1);
                         r.set_until_us(std::int64_t{1} << 60);
                       }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) {
                         *r.mutable_region()->mutable_root() = frame(1, 20);
                         r.mutable_region()->set_max_edges(4);
                         r.mutable_region()->set_max_metres(3);
                       }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_min_suspicion(0.1); }))
                 .bytes());
  for (const auto order : {v1::EDGE_ORDER_SUSPICION, v1::EDGE_ORDER_TIME})
    corpus.add("list_edges_in_order_" + std::to_string(order), {},
               Calls()
                   .call("ListEdges", edges([&](v1::ListEdgesRequest& r) {
                           r.set_order(order);
                           r.set_page_size(1);
                         }))
                   .call("ListEdges", edges([&](v1::ListEdgesRequest& r) {
                           r.set_order(order);
                           r.set_page_token(kHeard);
                         }))
                   .call("ListEdges", edges([&](v1::ListEdgesRequest& r) {
                           r.set_order(v1::EDGE_ORDER_ID);
                           r.set_page_token(kHeard);
                         }))
                   .bytes());
  const auto matrix = [](std::uint32_t session, std::uint32_t size, const char* token) {
    return with<v1::GetClosureMatrixRequest>([&](v1::GetClosureMatrixRequest& r) {
      if (session != 0) r.add_sessions(session);
      r.set_page_size(size);
      r.set_page_token(token);
    });
  };
  corpus.add("closure_matrix", {},
             Calls()
                 .call("GetClosureMatrix", matrix(0, 1, ""))
                 .call("GetClosureMatrix", matrix(0, 0, kHeard))
                 .call("GetClosureMatrix", matrix(3, 0, ""))
                 .call("GetClosureMatrix", matrix(9, 0, "x"))
                 .bytes());
  corpus.add("list_audit", {}, Calls().call("ListAudit", v1::ListAuditRequest()).bytes());
  corpus.add("list_edges_of_nothing", {},
             Calls()
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.add_states(static_cast<v1::EdgeState>(9)); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_session(9); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { *r.mutable_frame() = frame(9, 45); }))
                 .call("ListEdges", edges([](v1::ListEdgesRequest& r) { r.set_page_token("x"); }))
                 .bytes());
  const auto explained = [](std::uint32_t index, std::uint32_t ordinal, bool pictures) {
    return with<v1::ExplainEdgeRequest>([&](v1::ExplainEdgeRequest& r) {
      *r.mutable_edge()->mutable_frame() = frame(1, index);
      r.mutable_edge()->set_ordinal(ordinal);
      r.set_pictures(pictures);
    });
  };
  corpus.add("explain_edge", {},
             Calls()
                 .call("ExplainEdge", explained(45, 1, true))
                 .call("ExplainEdge", explained(45, 0, false))
                 .call("ExplainEdge", explained(9, 7, false))
                 .call("ExplainEdge", v1::ExplainEdgeRequest())
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
  corpus.add("watch", {},
             Calls()
                 .call("SetLabel", label(3, "Hall north", false))
                 .call("WatchMap", with<v1::WatchMapRequest>([](v1::WatchMapRequest& r) {
                         r.set_from(v1::WATCH_FROM_OLDEST);
                         r.add_sessions(1);
                       }))
                 .call("WatchMap", with<v1::WatchMapRequest>([](v1::WatchMapRequest& r) {
                         r.set_resume_token(kHeard);
                         r.set_no_frames(true);
                       }))
                 .call("WatchMap", with<v1::WatchMapRequest>([](v1::WatchMapRequest& r) {
                         r.set_resume_token("1.00112233-4455-6677-8899-aabbccddeeff.1.0.2.3.00000000");
                       }))
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
  const auto drawn = [](auto set) { return with<v1::GetSkeletonRequest>(set); };
  for (const std::uint32_t level : {0u, 1u, 2u, 3u, 4u})
    corpus.add("skeleton_" + std::to_string(level), {},
               Calls()
                   .call("GetSkeleton", drawn([&](v1::GetSkeletonRequest& r) {
                           r.set_level(level);
                           r.set_candidates(true);
                         }))
                   .call("GetSkeleton", drawn([&](v1::GetSkeletonRequest& r) {
                           r.set_level(level);
                           r.set_resume_token(kHeard);
                         }))
                   .call("GetSkeleton", drawn([&](v1::GetSkeletonRequest& r) {
                           r.set_level(level);
                           r.add_sessions(1);
                           r.add_sessions(level);
                         }))
                   .call("GetSkeleton", drawn([](v1::GetSkeletonRequest& r) { r.set_resume_token("x-1-2"); }))
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

}  // namespace

void write_questions(const std::string& root) {
  const Corpus corpus(root, "rpc_request_fuzz");
  add_places(corpus, fuzzing::read_file(root + "/picture_fuzz/grey.jpg"));
  add_routes(corpus);
  add_lists(corpus);
}

}  // namespace relmap::testing
