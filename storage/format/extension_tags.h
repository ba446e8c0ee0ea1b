// The tags of extensions of records, which say what they mean (docs/storage-format.md, Extensions, has also those that
// are reserved). A tag means the same in every record, so that what a proposal or a keyframe says goes on in the edge
// or frame that it becomes. A tag that has been used is never given another meaning.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/map_identity.h"
#include "proto/keyframe/extensions.h"
#include "storage/graph/frame.h"
#include "storage/graph/map_state.h"

namespace relmap::storage::tags {

inline constexpr std::uint32_t kUniqueness = 1;  // of an edge, or a proposal
inline constexpr std::uint32_t kDecided = 2;     // of an edit of an edge: true if present; no bytes
inline constexpr std::uint32_t kCarried = 3;  // of a closure: the frames along which it says that the robot was carried
inline constexpr std::uint32_t kEvidence = 22;      // of a closure: what the judgements of closures found out about it
inline constexpr std::uint32_t kAlone = 25;         // of an edit of an edge: it concerns this edge only; no bytes
inline constexpr std::uint32_t kBeforeFrozen = 26;  // of a session: the state that it had before it was frozen
inline constexpr std::uint32_t kShown = 27;         // of an edit of an edge: a mark of what it may remove
inline constexpr std::uint32_t kWayAround = 28;     // of a closure, or a proposal
inline constexpr std::uint32_t kUnseen = 29;        // of a closure: frames that saw nothing of where it leads
inline constexpr std::uint32_t kUnseenPlace = 30;   // of a proposal: the closure of whose place the query saw nothing
inline constexpr std::uint32_t kEditKey = 31;       // of an edit in the journal: by what its caller names it

inline constexpr std::uint32_t kDigests = 36;      // of the map's state: the commit as of which its digests are right
inline constexpr std::uint32_t kDigestsMade = 37;  // of the map's state: how far they were made anew

// These tags say how the map came about, so map hashes leave them out. kOwner is reserved.
inline constexpr std::uint32_t kMapIdentity = 16, kEpoch = 17;  // of the map's state
inline constexpr std::uint32_t kOwner = 18;
// Of records in the journal, and of edges for the events of their history; the author also of a session that is being
// deleted.
inline constexpr std::uint32_t kWallTime = 19, kAuthor = 20;
inline bool is_hashed(std::uint32_t tag) { return tag < kMapIdentity || tag > kAuthor; }

// They write nothing where the value is unknown or the default.
void add_uniqueness(Extensions& extensions, const Uniqueness& uniqueness);
void add_carried(Extensions& extensions, const FrameRange& carried);
void add_closure_tests(Extensions& extensions, const ClosureTests& tests);
void add_way_around(Extensions& extensions, const WayAround* around);  // nullptr: there is none
void add_unseen(Extensions& extensions, const std::vector<std::uint32_t>& unseen);
void add_unseen_place(Extensions& extensions, ClosureId closure);  // invalid: there is none
void add_map_identity(Extensions& extensions, const MapIdentity& identity);
void add_before_frozen(Extensions& extensions, SessionState state);
void add_shown(Extensions& extensions, std::uint64_t shown);
void add_digests_commit(Extensions& extensions, std::uint64_t commit);
void add_digests_made(Extensions& extensions, const DigestsMade& made);
void add_edit_key(Extensions& extensions, const EditKey& edit);
void add_author(Extensions& extensions, const std::string& author);
void add_submission(Extensions& extensions, std::int64_t time_us, const std::string& author);
void add_submissions(Extensions& extensions, const std::vector<EdgeEvent>& history);
// They return false if the extension is malformed.
bool take_uniqueness(Extensions& extensions, Uniqueness& uniqueness);
bool take_carried(Extensions& extensions, FrameRange& carried);
bool take_closure_tests(Extensions& extensions, ClosureTests& tests);
bool take_way_around(Extensions& extensions, std::shared_ptr<const WayAround>& around);
bool take_unseen(Extensions& extensions, std::vector<std::uint32_t>& unseen);
bool take_unseen_place(Extensions& extensions, ClosureId& closure);
bool take_map_identity(Extensions& extensions, MapIdentity& identity);
bool take_before_frozen(Extensions& extensions, SessionState& state);
bool take_shown(Extensions& extensions, std::uint64_t& shown);
bool take_digests_commit(Extensions& extensions, std::uint64_t& commit);
bool take_digests_made(Extensions& extensions, DigestsMade& made);
bool take_edit_key(Extensions& extensions, EditKey& edit);
bool take_author(Extensions& extensions, std::string& author);
bool take_submission(Extensions& extensions, std::int64_t& time_us, std::string& author);
// Of the history as it was read. What is said of an event that it no longer has is dropped.
bool take_submissions(Extensions& extensions, std::vector<EdgeEvent>& history);

}  // namespace relmap::storage::tags
