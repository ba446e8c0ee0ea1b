// What speaks for and against a closure or a place, as a pair of pictures (client/pair_picture.h).
#pragma once

#include <optional>
#include <string>

#include "client/pair_picture.h"
#include "client/relmap_client.h"
#include "tools/relmap/session_names.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

// The older end of the closure at the left, the newer one at the right. Of an end whose picture the map has dropped,
// its thumbnail, if there is one, is shown instead; it is read from the daemon.
client::PairPicture pair_of(const client::EdgeExplanation& explained, const SessionsByNumber& sessions,
                            client::Client& client);

// A view and a place that it could show: the view at the left.
struct AskedView {
  std::string title;             // "photo.jpg"
  client::FramePicture picture;  // with the scale from the pixels of the correspondences
};
client::PairPicture pair_of(const AskedView& view, const client::PlaceMatch& place, const SessionsByNumber& sessions,
                            client::Client& client);

// The picture that the map keeps of a frame, else its thumbnail, else why there is none. Asked of the daemon.
client::FramePicture kept_picture(FrameId frame, const SessionsByNumber& sessions, client::Client& client);

}  // namespace relmap::cli
