#pragma once

#include <string_view>

namespace nbd {

/// A point of a run at which tests can act: work of this name, so much of it done. The environment variable
/// NBDTREE_AT, which nobody but a test sets, lists what happens as soon as so much is done, separated by
/// semicolons; each happens once:
///     NAME|DONE|interrupt   this process gets SIGINT, as by Ctrl-C
///     NAME|DONE|kill        this process gets SIGKILL
///     NAME|DONE|wait|FILE   this thread makes FILE.waits and waits for FILE, or until the user asks to stop
/// From any thread. Throws std::invalid_argument where the variable has another form.
void pass_test_point(std::string_view name, double done);

}  // namespace nbd
