//! The page: files of this program, so that it works without a network.

use std::sync::Arc;

use axum::Router;
use axum::http::header;
use axum::response::IntoResponse;
use axum::routing::get;

use super::Shared;

const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Path, type and text of each file.
const FILES: [(&str, &str, &str); 16] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/page/style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("/page/main.js", SCRIPT, include_str!("page/main.js")),
    ("/page/drive.js", SCRIPT, include_str!("page/drive.js")),
    ("/page/table.js", SCRIPT, include_str!("page/table.js")),
    ("/page/chart.js", SCRIPT, include_str!("page/chart.js")),
    ("/page/ticks.js", SCRIPT, include_str!("page/ticks.js")),
    ("/page/stability.js", SCRIPT, include_str!("page/stability.js")),
    ("/page/live.js", SCRIPT, include_str!("page/live.js")),
    ("/page/theme.js", SCRIPT, include_str!("page/theme.js")),
    ("/page/controls.js", SCRIPT, include_str!("page/controls.js")),
    ("/page/tables.js", SCRIPT, include_str!("page/tables.js")),
    ("/page/scale.js", SCRIPT, include_str!("page/scale.js")),
    ("/page/scene.js", SCRIPT, include_str!("page/scene.js")),
    ("/page/shapes.js", SCRIPT, include_str!("page/shapes.js")),
    ("/page/matrix.js", SCRIPT, include_str!("page/matrix.js")),
];

/// The paths of the page.
pub fn routes() -> Router<Arc<Shared>> {
    FILES.into_iter().fold(Router::new(), |routes, (path, content_type, text)| {
        let file = move || std::future::ready(([(header::CONTENT_TYPE, content_type)], text).into_response());
        routes.route(path, get(file))
    })
}
