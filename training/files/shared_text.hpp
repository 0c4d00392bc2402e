#pragma once

#include <memory>
#include <ostream>
#include <string>
#include <utility>

namespace nbd {

/// A text that does not change. Copies share its memory.
class SharedText {
 public:
    SharedText() : SharedText(std::string()) {}
    SharedText(std::string text)  // NOLINT(google-explicit-constructor): stands for the text
        : text_(std::make_shared<const std::string>(std::move(text))) {}
    SharedText(const char* text) : SharedText(std::string(text)) {}  // NOLINT(google-explicit-constructor)

    // Moving would leave a text without memory, so it copies.
    SharedText(const SharedText&) = default;
    SharedText& operator=(const SharedText&) = default;
    ~SharedText() = default;

    const std::string& str() const noexcept { return *text_; }
    operator const std::string&() const noexcept { return str(); }  // NOLINT(google-explicit-constructor)

    bool operator==(const SharedText& other) const noexcept {
        return text_ == other.text_ || *text_ == *other.text_;
    }
    friend std::ostream& operator<<(std::ostream& out, const SharedText& text) { return out << *text.text_; }

 private:
    std::shared_ptr<const std::string> text_;
};

}  // namespace nbd
