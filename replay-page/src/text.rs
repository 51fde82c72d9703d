//! The text of a page.

use serde_json::Value;

const PAGE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");

/// The whole file.
pub(crate) fn page(title: &str, map_svg: &str, data: &Value) -> String {
    // Within a script only this character can begin its end.
    let data = data.to_string().replace('<', "\\u003c");
    let mut text = String::with_capacity(PAGE.len() + map_svg.len() + data.len() + (1 << 16));
    // In one walk, so that what is put in is not searched.
    let mut rest = PAGE;
    while let Some((before, behind)) = rest.split_once("@@") {
        let Some((name, after)) = behind.split_once("@@") else { break };
        text.push_str(before);
        match name {
            "title" => text.push_str(&escaped(title)),
            "style" => text.push_str(STYLE),
            "script" => text.push_str(SCRIPT),
            "map" => text.push_str(map_svg),
            "data" => text.push_str(&data),
            _ => {}
        }
        rest = after;
    }
    text.push_str(rest);
    text
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
