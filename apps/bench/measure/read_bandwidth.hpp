#pragma once

namespace nbd {

/// Bytes a second that one thread reads from memory: the fastest of ten passes over 512 MB in order.
double read_bandwidth();

}  // namespace nbd
