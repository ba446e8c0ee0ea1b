// The options of a run of relmap-frontend, as its command line gives them.
#pragma once

#include <cstddef>
#include <string>

#include "frontend/publishing/publisher.h"
#include "frontend/tracking/keyframe_pictures.h"

namespace relmap::workflow {

struct RunOptions {
  std::string source = "auto";  // a kind of open_source(), or log, or iidc for a camera
  std::string path;             // folder or file; for iidc the camera's serial number, empty for the only one
  std::string robot;            // empty: the robot in the recorded keyframes, if these are the input
  std::string session;          // empty: the name of the folder or file, or of the recorded session
  std::string recorded;         // session of a log (choose_session()); empty: the only one
  std::string uuid;             // of the new session; empty: random
  bool as_recorded = false;     // a log's session keeps the uuid that it was recorded with
  std::string camera;           // mono: the camera whose pictures to use (picture_camera.h); empty: the only one
  std::string calibration;      // file; empty: the one in the source's folder, or the camera's own
  std::string camera_folder;    // calibrations of cameras (camera_folder.h); empty: the default folder
  std::string bus = "auto";     // auto, usb, 1394
  bool wait = false;            // wait for a camera that is not connected yet or not available
  std::string imu = "auto";     // a recording for read_imu(); auto: that of the data set, if it has one; or none
  std::string to = "lcm";       // lcm, grpc or file
  std::string server;           // for grpc: the daemon's data folder or HOST:PORT
  std::string credentials;      // for grpc over TLS: the file that proves who sends; empty: none
  std::string out;              // for file: its path
  std::string report;           // TSV file (report_file.h); empty: none
  std::string show;             // folder or .mp4 (track_show.h); empty: none
  publishing::PublisherOptions publisher;
  double patience_s = 60;      // seconds to wait for a silent daemon without progress
  double rate_hz = 0;          // of the pairs; 0: unlimited. For a camera, its frame rate; 0: as in its settings
  std::size_t every = 1;       // use every n-th pair
  bool all_keyframes = false;  // every pair becomes one
  tracking::KeyframePicture picture =
      tracking::KeyframePicture::kWhole;  // the picture in a keyframe; not for mono, where it is small
  bool mono = false;           // the source is pictures of one camera, for a mono session (open_mono_images())
  bool live = false;           // the source cannot wait
  bool despite_check = false;  // track a recording even if its stereo camera is faulty (RigReport::wrong)
  bool oneway = false, quiet = false;
  bool progress_json = false;  // print progress as JSON on standard output
};

}  // namespace relmap::workflow
