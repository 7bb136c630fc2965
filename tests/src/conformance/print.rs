//! JSON as people read the file: lists of numbers on one line.

use serde_json::Value;

/// The text of a value, an end of line at its end.
#[must_use]
pub fn print(value: &Value) -> String {
    let mut text = String::new();
    write(value, 0, &mut text);
    text.push('\n');
    text
}

fn is_flat(value: &Value) -> bool {
    match value {
        Value::Object(_) => false,
        Value::Array(items) => items.iter().all(is_flat),
        _ => true,
    }
}

fn write(value: &Value, depth: usize, text: &mut String) {
    let mut block = |open: char, close: char, parts: Vec<(String, &Value)>| {
        text.push(open);
        for (number, (head, part)) in parts.iter().enumerate() {
            text.push_str(if number == 0 { "\n" } else { ",\n" });
            text.push_str(&" ".repeat(depth + 1));
            text.push_str(head);
            write(part, depth + 1, text);
        }
        text.push('\n');
        text.push_str(&" ".repeat(depth));
        text.push(close);
    };
    match value {
        Value::Object(members) if !members.is_empty() => {
            let head = |name: &String| format!("{}: ", Value::from(name.as_str()));
            block('{', '}', members.iter().map(|(name, part)| (head(name), part)).collect());
        }
        Value::Array(items) if !is_flat(value) => {
            block('[', ']', items.iter().map(|part| (String::new(), part)).collect());
        }
        Value::Array(items) => {
            text.push('[');
            for (number, item) in items.iter().enumerate() {
                text.push_str(if number == 0 { "" } else { ", " });
                write(item, depth, text);
            }
            text.push(']');
        }
        _ => text.push_str(&value.to_string()),
    }
}
