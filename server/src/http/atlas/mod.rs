//! The atlas: as it was shipped, as OBJ and glTF, and its mask.

mod glb;

use axum::{
    extract::State,
    http::{HeaderMap, Uri, header},
    response::Response,
};
use bytes::Bytes;
use papilla_proto::{ErrorCode, Problem};

use super::{Answer, Shared, refuse, tagged};
use crate::{codec, problem};

pub(super) async fn json(State(app): Shared, headers: HeaderMap) -> Response {
    let asked = headers.get(header::IF_NONE_MATCH);
    let catalogue = app.catalogue();
    let body = catalogue.atlas_json.clone();
    tagged("application/json", catalogue.atlas.hash(), asked, body)
}

pub(super) async fn obj(State(app): Shared, headers: HeaderMap) -> Response {
    let asked = headers.get(header::IF_NONE_MATCH);
    let catalogue = app.catalogue();
    let atlas = &catalogue.atlas;
    tagged("model/obj", atlas.hash(), asked, Bytes::from(atlas.to_obj()))
}

/// Both patches as binary glTF, each with its mask as a texture.
pub(super) async fn glb(State(app): Shared, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let mut masks = [Vec::new(), Vec::new()];
    for (raster, png) in [&catalogue.skin, &catalogue.interface].into_iter().zip(&mut masks) {
        codec::encode_mask(raster.mask(), png)
            .map_err(|error| problem::internal("the mask cannot be encoded", &error))?;
    }
    let atlas = &catalogue.atlas;
    let asked = headers.get(header::IF_NONE_MATCH);
    let tag = format!("{}-glb", atlas.hash());
    Ok(tagged("model/gltf-binary", &tag, asked, Bytes::from(glb::write(atlas, &masks))))
}

/// White where the patch is: the interface, or with `?patch=skin` the skin.
pub(super) async fn mask(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let catalogue = app.catalogue();
    let (patch, raster) = match uri.query() {
        None | Some("" | "patch=interface") => ("interface", &catalogue.interface),
        Some("patch=skin") => ("skin", &catalogue.skin),
        Some(_) => {
            let message = "the parameter is patch=interface or patch=skin";
            return refuse(&app, Problem::new(ErrorCode::BadQuery, message).at("patch"));
        }
    };
    let mut png = Vec::new();
    codec::encode_mask(raster.mask(), &mut png)
        .map_err(|error| problem::internal("the mask cannot be encoded", &error))?;
    let tag = format!("{}-{patch}", catalogue.atlas.hash());
    Ok(tagged("image/png", &tag, headers.get(header::IF_NONE_MATCH), Bytes::from(png)))
}
