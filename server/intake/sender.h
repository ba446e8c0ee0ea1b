// Who sends a message, whether he may send it, and with whom he shares what the intake has to give.
#pragma once

#include <string>

#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::intake {

// Who has sent a message, as far as that is proved.
struct Sender {
  std::string robot;      // proved to be this one; empty: an operator, who may send for any robot, or anyone
  bool anyone = false;    // nothing is proved, and robots that must prove themselves are out of reach
  std::string from = {};  // the address of one who proves nothing and may do everything; empty: another, or not known
};

// The robot of a session.
struct Owner {
  std::string robot;
  bool proves = false;  // that it is this robot: nobody else may send for it who proves nothing
};
// NOT_ALLOWED: the sender may not send for the session of this owner.
Status may_send(const Sender& sender, const SessionUuid& session, const Owner& owner);

// Those who get one share of what the intake has to give, so that nobody gets more by sending more sessions: a robot
// that has proved who it is, with all that it sends; a session that has begun, of one who proves nothing; and
// everything else together.
struct Party {
  SessionUuid session;
  std::string robot;
  auto operator<=>(const Party&) const = default;
};
// The party of what the sender sends to the session. `owner`: its robot; null while it has not begun.
Party party_of(const SessionUuid& session, const Sender& sender, const Owner* owner);

}  // namespace relmap::intake
