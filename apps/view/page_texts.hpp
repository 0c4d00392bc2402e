#pragma once

#include <span>
#include <string_view>

namespace nbd::page_texts {

// The files of page/, and three.js, as they were when the program was built.
std::string_view page_html();
std::string_view page_css();
std::string_view three_licence();
std::string_view three_js();
std::string_view orbit_controls_js();

struct Script {
    std::string_view name, text;
};

/// The scripts of a page after three.js, in the order in which they run.
std::span<const Script> scripts();

}  // namespace nbd::page_texts
