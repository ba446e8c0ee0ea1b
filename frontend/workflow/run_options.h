// What a run of relmap-frontend is asked for, as its command line says it.
#pragma once

#include <cstddef>
#include <string>

#include "frontend/publishing/publisher.h"
#include "frontend/tracking/keyframe_pictures.h"

namespace relmap::workflow {

struct RunOptions {
  std::string source = "auto";  // kind, for open_source(), or log, or iidc: a camera
  std::string path;             // the source's folder or file; of iidc the camera's serial number, empty: the only one
  std::string robot;            // empty: as recorded, where keyframes come in
  std::string session;          // empty: the name of the folder or file, or of the session recorded there
  std::string recorded;         // session of a log (choose_session()); empty: the only one
  std::string uuid;             // of a new session; empty: random
  bool as_recorded = false;     // a log's session under the uuid that it was recorded with
  std::string camera;           // of mono pictures of several cameras: whose (picture_camera.h); empty: the only one
  std::string calibration;      // empty: what the source's folder holds, of a camera its own
  std::string camera_folder;    // camera_folder.h; empty: the default one
  std::string bus = "auto";     // usb, 1394
  bool wait = false;            // for a camera that is not there yet, or not to be had
  std::string imu = "auto";     // a recording for read_imu(); auto: the data set's, if it has one; none
  std::string to = "lcm";       // or grpc, file
  std::string server;           // for grpc: a data folder or HOST:PORT
  std::string out;              // that file
  std::string report;           // TSV (report_file.h); empty: none
  std::string show;             // folder or .mp4 (track_show.h); empty: none
  publishing::PublisherOptions publisher;
  double patience_s = 60;  // without progress of a silent daemon
  double rate_hz = 0;  // of the pairs; 0: as fast as they come. Of a camera what it is set to; 0: as its settings say
  std::size_t every = 1;       // every n-th pair
  bool all_keyframes = false;  // every pair becomes one
  tracking::KeyframePicture picture =
      tracking::KeyframePicture::kWhole;  // that a keyframe carries; of one eye a small one
  bool mono = false;                      // pictures of one camera, for a mono session (open_mono_images())
  bool live = false;                      // the source cannot wait
  bool despite_check = false;             // a recording is tracked though its eyes are plainly wrong (RigReport::wrong)
  bool oneway = false, quiet = false;
  bool progress_json = false;  // on standard output, for programs
};

}  // namespace relmap::workflow
