// Requests that change the map, or its daemon: edits, keyframes, and what administrators ask for.
#include "proto/base/crc32c.h"
#include "tests/write_corpus_calls.h"

namespace relmap::testing {

namespace {

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

void write_edits(const std::string& root) {
  const Corpus corpus(root, "rpc_request_fuzz");
  add_edits(corpus);
  add_ingest(corpus);
  add_admin(corpus);
}

}  // namespace relmap::testing
